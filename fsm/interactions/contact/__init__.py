"""Kernels that all contacts use: frames, tangents, friction over bodies, impacts, sums."""
