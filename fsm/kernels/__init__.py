"""Compiled functions that several packages share, and the decorator that compiles them."""
