"""Membrane elements, wrinkles, and the air around a film."""
