"""Checks of values with an upper bound; without another figure, a figure shows the ratios of values and bounds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from fsm.views.plots.style import COLOURS, figure
from validation.gallery.record import Check, below

__all__ = ["with_margins"]


def with_margins(found: Sequence[tuple[str, float, float]], source: str, picture: Path) -> Iterator[Check]:
    """Figure of rows (quantity, value, largest allowed value)."""
    if not picture.is_file():
        draw_margins(picture, found)
    for what, value, allowed in found:
        name, _, rest = what.partition(": ")
        yield below(rest or name, name if rest else "", float(value), float(allowed), source, picture)


def draw_margins(path: Path, found: Sequence[tuple[str, float, float]]) -> None:
    """One bar for each row: value over bound, on a logarithmic scale."""
    shown = [(what, max(abs(value / allowed), 1e-6)) for what, value, allowed in found if allowed]
    with figure(path, (6.4, 0.9 + 0.28 * len(shown))) as fig:
        ax = fig.subplots()
        names, parts = zip(*reversed(shown), strict=True)
        ax.barh(names, parts, color=[COLOURS[0] if part <= 1.0 else COLOURS[1] for part in parts], height=0.6)
        ax.axvline(1.0, color="black", lw=1)
        ax.set(xscale="log", xlabel="value over what is allowed", xlim=(1e-6, 10.0))
