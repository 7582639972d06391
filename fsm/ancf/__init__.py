"""The absolute nodal coordinate formulation: cables and membranes whose nodes have positions and slopes."""
