"""Names of loads in results."""

from __future__ import annotations

__all__ = ["PRESSURE"]

PRESSURE = ", pressure"
"""Suffix of the name of a pressure on nodes in results. Such a load has a size in Pa, and a swept volume (m^3) in place
of a displacement."""
