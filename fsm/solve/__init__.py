"""Solvers; they use only the System protocol."""
