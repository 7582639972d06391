"""Checks against references from outside the project, and measurements."""
