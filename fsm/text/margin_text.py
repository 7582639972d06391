"""Text of motorisation margins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fsm.text.shown_units import shown

_LISTED = 6
"""Largest number of joints with a text each."""


def margin_texts(margins: Sequence[Mapping[str, Any]]) -> list[str]:
    """One text for each of the joints with the smallest margins, the smallest first."""
    ordered = sorted(margins, key=lambda row: float("inf") if row["margin"] is None else row["margin"])
    texts = [margin_text(row) for row in ordered[:_LISTED]]
    return [*texts, *([f"and {len(ordered) - _LISTED} larger ones"] if len(ordered) > _LISTED else [])]


def negative_margins(margins: Sequence[Mapping[str, Any]]) -> list[str]:
    """Warnings on joints that may not move."""
    negative = [row for row in margins if row["margin"] is not None and row["margin"] < 0.0]
    return [f"the motorisation margin is negative: {margin_text(row)}" for row in negative]


def margin_text(row: Mapping[str, Any]) -> str:
    """Smallest margin of a joint, with its angle and moments."""
    moments = f"available {shown(row['available'], 'N m')}, required {shown(row['required'], 'N m')}"
    margin = "no moment required" if row["margin"] is None else f"{row['margin']:.3g}"
    return f"{row['joint']} {margin} at {shown(row['angle'], 'rad')} ({moments})"
