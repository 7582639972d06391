"""Solvers, which depend on the System protocol only."""
