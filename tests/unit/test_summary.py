"""What a summary advises."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fsm.solve.handed_over import Statistics
from fsm.solve.ledger import Ledger
from fsm.solve.settings import Settings
from fsm.summary import summary_of


def warned(method: str, off: float, step: float | None = None) -> list[str]:
    """Warnings of a run by a method, perhaps at a fixed step, whose balance is off by a part of what was turned over."""
    analysis = SimpleNamespace(
        summarise=lambda solution, statistics: {},
        warnings=lambda solution, summary: [],
        settings=lambda method: Settings(method, 1e-4, 1.0, step=step),
        system=SimpleNamespace(nu=9),
    )
    solution = SimpleNamespace(negative_pivots=np.zeros(1), layout=SimpleNamespace(dimension="spatial"))
    ledger = SimpleNamespace(relative_error=off)
    summary = summary_of(cast(Any, analysis), cast(Any, solution), Statistics(method), cast(Ledger, ledger), [])
    return list(summary["warnings"])


@pytest.mark.parametrize(
    ("method", "step", "helps", "useless"),
    [
        ("modal", None, "vibration.modes", "rtol"),
        ("generalized-alpha", None, "tighten rtol", "vibration.modes"),
        ("generalized-alpha", 1e-4, "shorter solve.step", "rtol"),
    ],
)
def test_a_balance_that_is_off_is_told_with_what_helps(
    method: str, step: float | None, helps: str, useless: str
) -> None:
    (line,) = warned(method, 0.02, step)
    assert "energy balance off by 0.02" in line
    assert helps in line and useless not in line
    assert warned(method, 1e-4) == []
