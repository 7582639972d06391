"""Compilation of a case and its scene: names become indices, models become arrays."""
