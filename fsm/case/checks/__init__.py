"""Faults that involve several sections of a case."""
