"""Faults of a scene that are found before it is solved."""
