"""Tape springs against the theory of their moments, and beside CalculiX."""
