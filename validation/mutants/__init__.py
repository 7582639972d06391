"""Faults put into the product's physics on purpose, each with the check that must catch it."""
