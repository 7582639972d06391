"""Contact and friction: what all geometries share, memory, forces, and their tables in a compiled model."""
