"""Statements of three papers in words and numbers."""
