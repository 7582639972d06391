"""Checks against references that nobody here wrote, and measurements."""
