"""Sections of a case, one file each, and the parts of a scene that builders add.

Modules whose annotations need no import for type checkers have no ``from __future__ import annotations``: pydantic would
compile the text of each annotation when a section is imported, which takes a tenth of this import.
"""
