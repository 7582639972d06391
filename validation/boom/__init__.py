"""Tape springs, compared with the theory of their moments and with CalculiX."""
