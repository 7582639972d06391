"""Measured laws of creases and hinges, for `library` of a crease in a case file."""

from fsm.library.entries import Entry, entries

__all__ = ["Entry", "entries"]
