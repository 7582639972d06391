"""Compiled functions that the rest of the package is built on."""
