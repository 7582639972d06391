"""Geometry of folded sheets: generated patterns, folded states, meshes, places, chambers."""
