"""Result of a study: responses of its runs, and what these say about the parameters."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fsm.case.models.study import StudyFile
from fsm.errors import FsmError
from fsm.studies.indices import Indices, Regression, regression, sobol_indices, tornado
from fsm.studies.problem import CURVE, Run
from fsm.studies.scatter import Design, Scatter

RANDOM = ("sobol", "latin")
"""Designs whose runs are a sample of the scatter, so that quantiles have their probabilities."""


@dataclass(frozen=True)
class StudyResult:
    """Result of a study.

    Attributes
    ----------
    file : StudyFile
    source : Path
        Study file.
    scatters : list of Scatter
    design : Design
    nominal : Run
        Run with the nominal values.
    runs : list of Run or None
        Runs in the order of the design; None for a run that failed.
    errors : list of str
        Causes of failures; empty for other runs.
    """

    file: StudyFile
    source: Path
    scatters: list[Scatter]
    design: Design
    nominal: Run
    runs: list[Run | None]
    errors: list[str]

    @property
    def paths(self) -> list[str]:
        """Paths of the parameters."""
        return [one.path for one in self.scatters]

    @property
    def groups(self) -> list[str]:
        """Names of independent groups of parameters."""
        return [" + ".join(self.paths[k] for k in group) for group in self.design.groups]

    @property
    def failed(self) -> int:
        """Number of runs that failed."""
        return sum(run is None for run in self.runs)

    def response(self, key: str) -> np.ndarray:
        """Values (n,) of a response, SI; NaN for runs that failed."""
        return np.array([np.nan if run is None else run.responses[key] for run in self.runs])

    def quantiles(self, key: str) -> tuple[float, float, float]:
        """Lower end, median and upper end of a response at the level of the study; without probabilities its range."""
        values = self.response(key)
        values = values[np.isfinite(values)]
        if not len(values):
            return np.nan, np.nan, np.nan
        part = self.file.level if self.file.design.kind in RANDOM else 1.0
        low, middle, high = np.quantile(values, [0.5 - 0.5 * part, 0.5, 0.5 + 0.5 * part])
        return float(low), float(middle), float(high)

    def indices(self, key: str) -> Indices | None:
        """Sobol indices of a response; None for other designs, or with too few complete rows."""
        if not self.design.sample:
            return None
        return sobol_indices(self.response(key), self.design.sample, self.file.level, self.file.seed)

    def regression(self, key: str) -> Regression | None:
        """Linear regression of a response; None with too few runs."""
        return regression(self.design.values, self.response(key), self.file.level)

    def tornado(self, key: str) -> np.ndarray:
        """Response at the low and high end of each parameter, (p, 2)."""
        low, high = (np.array([getattr(one, end) for one in self.scatters]) for end in ("low", "high"))
        return tornado(self.design.values, self.response(key), self.design.varied, low, high, self.regression(key))

    def curves(self) -> tuple[np.ndarray, np.ndarray]:
        """Travels (m,) up to the smallest travel of all runs, m, and forces (n, m), N, of the runs with a curve."""
        kept = [run for run in self.runs if run is not None and run.curve]
        if not kept:
            return np.zeros(0), np.zeros((0, 0))
        travel = np.linspace(0.0, min(run.travel for run in kept), CURVE)
        return travel, np.array([np.interp(travel, np.linspace(0.0, run.travel, CURVE), run.curve) for run in kept])

    def causes(self) -> list[tuple[str, int, list[int]]]:
        """Causes of failures: text of the first run, number of runs, their numbers; texts that differ in numbers are one."""
        kinds = [re.sub(r"[-+]?\d[\d.,e+-]*", "#", error) for error in self.errors]
        return [
            (self.errors[kinds.index(kind)], count, [k for k, one in enumerate(kinds) if one == kind])
            for kind, count in Counter(kind for kind in kinds if kind).most_common()
        ]


def result_lines(result: StudyResult) -> list[str]:
    """Lines for the terminal: responses, indices or regression, failures."""
    file, lines = result.file, []
    low_text = f"{100 * file.level:g} % band" if file.design.kind in RANDOM else "range"
    for one in file.response:
        unit = result.nominal.units[one.key]
        low, middle, high = result.quantiles(one.key)
        lines.append(
            f"{one.key}: nominal {result.nominal.responses[one.key]:.5g}, median {middle:.5g}, "
            f"{low_text} {low:.5g} to {high:.5g} {unit}".rstrip()
        )
        found, fitted = result.indices(one.key), result.regression(one.key)
        if found is not None:
            for name, s, t, bs, bt in zip(
                result.groups, found.first, found.total, found.first_interval, found.total_interval, strict=True
            ):
                lines.append(
                    f"  {name}: first index {s:.3f} ({bs[0]:.3f} to {bs[1]:.3f}), total {t:.3f} ({bt[0]:.3f} to {bt[1]:.3f})"
                )
            if found.lost:
                lines.append(
                    f"  {found.lost} of {found.lost + found.rows} rows of the base sample left out: a run of them failed"
                )
        elif result.design.varied is not None:
            for name, (a, b) in zip(result.paths, result.tornado(one.key), strict=True):
                lines.append(f"  {name}: {a:.5g} to {b:.5g} {unit}")
        elif fitted is not None:
            lines.append(f"  regression explains {100 * fitted.determination:.3g} % of the variance")
            lines += [
                f"  {name}: standardised slope {b:+.3f}" for name, b in zip(result.paths, fitted.standardised, strict=True)
            ]
    for text, count, numbers in result.causes():
        shown = ", ".join(map(str, numbers[:5])) + (", ..." if count > 5 else "")
        lines.append(f"failed: {count} of {len(result.runs)} runs ({shown}): {text}")
    return lines


def check_failed(result: StudyResult) -> None:
    """Raise an error if runs failed.

    Raises
    ------
    FsmError
    """
    if result.failed:
        error = FsmError(f"{result.failed} of {len(result.runs)} runs failed")
        error.exit_code = 3
        raise error
