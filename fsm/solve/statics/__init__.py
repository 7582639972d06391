"""Paths of equilibria, with snap-throughs and arc length."""
