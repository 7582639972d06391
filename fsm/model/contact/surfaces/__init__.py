"""Contact of panels of segments: probe points of one panel on the surface of another."""
