"""Builders of scenes from the sections of a case."""
