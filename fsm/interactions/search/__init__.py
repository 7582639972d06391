"""Search for near pairs: boxes, their tree, and bounds of displacements."""
