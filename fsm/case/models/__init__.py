"""Sections of a case, one file each, and the parts of a scene that builders add."""
