"""Scalar laws: deformations and rates in, effort and slopes out; no geometry."""
