"""Measures of batches of deformations, and how efforts scatter into forces and tangents."""
