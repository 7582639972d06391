"""Contact of flexible facets with each other."""
