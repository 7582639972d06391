"""Names of loads in results."""

from __future__ import annotations

__all__ = ["PRESSURE"]

PRESSURE = ", pressure"
"""Text behind the name of a pressure on nodes in results: its size is in Pa, and its displacement is a volume, m^3."""
