"""Pictures of a case before it runs: preview, sheet, mesh of flexible facets."""
