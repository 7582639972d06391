"""Builders: a few numbers in, a scene out."""
