"""Stated and true errors of random cases, and the table of their coverage."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

__all__ = ["Kind", "Number", "table"]

_NEGLIGIBLE = 1e-4
"""True error that counts as covered by any statement."""


@dataclass(frozen=True)
class Number:
    """Number of a case: its name, the stated error (None: not stated), and the error against a reference, both relative."""

    name: str
    stated: float | None
    true: float

    @property
    def covered(self) -> bool:
        """Whether the statement contains the true error."""
        return self.true <= max(self.stated or 0.0, _NEGLIGIBLE)


@dataclass(frozen=True)
class Kind:
    """Kind of stated error: title, and numbers of a random case drawn by a generator."""

    title: str
    numbers: Callable[[np.random.Generator], Iterator[Number]]


def table(found: dict[str, list[list[Number]]]) -> str:
    """Markdown table: kind, cases, covered numbers, cases with all numbers covered, median ratio, worst ratio."""
    lines = [
        "| error due to | cases | numbers | covered | cases covered | not stated | median stated/true | worst true/stated |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for title, cases in found.items():
        stated = [[n for n in numbers if n.stated is not None] for numbers in cases]
        every = [n for numbers in stated for n in numbers]
        if not every:
            lines.append(f"| {title} | {len(cases)} | 0 | - | - | {sum(map(len, cases))} | - | - |")
            continue
        real = [n for n in every if n.true > _NEGLIGIBLE]
        ratio = float(np.median([(n.stated or 0.0) / n.true for n in real])) if real else float("nan")
        worst = max((n.true / max(n.stated or 0.0, 1e-300) for n in real), default=0.0)
        whole = [numbers for numbers in stated if numbers]
        lines.append(
            f"| {title} | {len(cases)} | {len(every)} | {sum(n.covered for n in every) / len(every):.1%} "
            f"| {sum(all(n.covered for n in numbers) for numbers in whole)} of {len(whole)} "
            f"| {sum(n.stated is None for numbers in cases for n in numbers)} | {ratio:.3g} | {worst:.3g} |"
        )
    return "\n".join(lines)
