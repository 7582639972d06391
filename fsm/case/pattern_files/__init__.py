"""Crease patterns from files: FOLD, SVG, ORIPA, and lists of lines."""
