"""Planar beams and the hinges between them."""
