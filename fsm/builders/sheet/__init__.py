"""Builder of a folded sheet: facets that are rigid, flexible or bars, with joints, supports and loads."""
