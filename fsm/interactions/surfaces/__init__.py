"""Contact of points with the C1 surface of a panel of segments."""
