"""Finite segments: compilation of a scene into arrays, and the system of equations of motion."""
