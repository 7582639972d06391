"""Faults that are put into the physics of the product on purpose, each with the check that must detect it."""
