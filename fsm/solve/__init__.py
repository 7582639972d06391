"""Solvers that know only the System protocol."""
