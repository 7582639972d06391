"""Absolute nodal coordinates: shape functions, groups, cables and bars; nodes have positions and slopes."""
