"""Scalar laws: efforts and their slopes from deformations and rates, without geometry."""
