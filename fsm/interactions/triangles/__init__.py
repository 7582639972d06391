"""Contact of a surface of triangles with itself."""
