"""A barrier law of contact against the linear and the Hertz law, for sheets that touch themselves.

The barrier of Li, Ferguson et al. (2020, ACM Trans. Graph. 39(4), 49) has the energy U = -K (g - w)^2 ln(g/w) of a face.
The gap g = w - d decreases from the width w to zero while the penetration d increases from zero to w; the force is infinite
at g = 0. Below g = w/100 the energy is quadratic, so that forces of trial states are finite. The width is the thickness
("barrier") or a tenth of it ("narrow barrier"). The damper is the one of the linear law.

With the factor 1 the linear law has the stiffness of the case. The other laws have its force, without its ramp, at a tenth
of the thickness; the narrow barrier at a tenth of its width. The factor multiplies stiffness and damping. The error is that
of the force at the last but one saved state of the shortest run (tube: packed, at 200 s), relative to the largest force
until then. The reference is the linear law with the factor 10000.

    python -m validation.sheets.barrier [--cases zigzag miura tube] [--sheets 10] [--factors 0.01 1 10 100 1000]
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import fsm
from fsm.case.schema.units import Length
from fsm.extend import NormalLaw, Section, add_contact_law
from validation.sheets.self_contact import closing_zigzag, intersecting, packed_miura, solved

__all__ = ["BARRIER", "Run"]

_END = 0.99
"""Penetration over the width from which the energy is quadratic."""
_PACKED = 20
"""Saved state in which the tube is packed."""
_KINDS = ["zigzag", "miura", "tube"]


class Width(Section):
    """Section [contact.parameters]."""

    width: Length


def _barrier(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Energy over K w^2, force over K w and slope over K, by the penetration x over the width."""
    b, over = np.clip(x, 0.0, _END), np.maximum(x - _END, 0.0)
    left, log = 1.0 - b, np.log1p(-b)
    force, slope = b * b / left - 2.0 * b * log, -2.0 * log + 4.0 * b / left + (b / left) ** 2
    return -b * b * log + over * (force + 0.5 * slope * over), force + slope * over, slope


def _force(
    depth: np.ndarray, closing: np.ndarray, onset: np.ndarray, share: np.ndarray, params: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    stiffness, width, damping, ramp = params
    _, elastic, slope = _barrier(depth / width)
    s = np.clip(depth / ramp, 0.0, 1.0)
    ramped, steepness = damping * s * s * (3.0 - 2.0 * s), 6.0 * damping * s * (1.0 - s) / ramp
    total = stiffness * width * elastic + ramped * closing
    slopes = np.column_stack([stiffness * slope + steepness * closing, ramped])
    acting = (depth > 0.0) & (total > 0.0)
    return np.where(acting, share * total, 0.0), np.where(acting[:, None], share[:, None] * slopes, 0.0)


def _energy(depth: np.ndarray, share: np.ndarray, params: np.ndarray) -> np.ndarray:
    return share * params[0] * params[1] ** 2 * _barrier(depth / params[1])[0]


def _params(contact: Any) -> np.ndarray:
    return np.array([contact.stiffness, contact.parameters["width"], contact.damping, contact.ramp])


BARRIER = NormalLaw(_force, _energy, _params, restitution=False, rate_dependent=lambda params: bool(params[2] > 0.0))
add_contact_law("barrier", BARRIER, Width, "barrier of Li, Ferguson et al. (2020)")
_LAWS = {"linear": 0.0, "hertz": 0.0, "barrier": 1.0, "narrow barrier": 0.1}
"""Laws with the width of the barrier over the thickness."""


def largest_difference() -> float:
    """Largest relative error of force and slopes of the barrier, against central differences."""
    x = np.concatenate([np.linspace(0.01, 0.98, 98), np.linspace(1.0, 3.0, 21)]) * 1e-3
    one, speed, params, h, v = np.ones_like(x), np.full_like(x, 1e-4), np.array([2.0, 1e-3, 3.0, 1.03e-4]), 1e-9, 1e-5

    def force(depth: np.ndarray, closing: np.ndarray) -> np.ndarray:
        return _force(depth, closing, one, one, params)[0]

    slopes = _force(x, speed, one, one, params)[1]
    by_energy = (_energy(x + h, one, params) - _energy(x - h, one, params)) / (2.0 * h) / force(x, 0.0 * x)
    by_depth = (force(x + h, speed) - force(x - h, speed)) / (2.0 * h) / slopes[:, 0]
    by_closing = (force(x, speed + v) - force(x, speed - v)) / (2.0 * v) / slopes[:, 1]
    return float(np.abs(np.stack([by_energy, by_depth, by_closing]) - 1.0).max())


class Run(NamedTuple):
    """Forces (N), steps, iterations, largest penetration over the thickness, states that intersect, processor time (s)."""

    force: np.ndarray
    steps: int
    iterations: int
    depth: float
    intersections: int
    seconds: float


def run(case: dict[str, Any], law: str, factor: float) -> Run | None:
    """Results of a case with a law; None without a solution. A line goes to the standard error stream."""
    model = fsm.load(case).model
    thickness, width = model.sheet.thickness, _LAWS[law] * model.sheet.thickness
    contact = {"law": law, "stiffness": factor * model.contact.stiffness, "damping": factor * model.contact.damping}
    if law == "hertz":
        contact["stiffness"] /= (0.1 * thickness) ** 0.5
    elif width:
        contact["stiffness"] *= 0.1 / float(_barrier(np.array(0.1))[1])
        contact |= {"law": "barrier", "exponent": 2.0, "parameters": {"width": width}}
    begun = time.process_time()
    result = solved(case | {"contact": contact})
    seconds = time.process_time() - begun
    if isinstance(result, str):
        print(f"{law} {factor:g}: {seconds:.1f} s, failed: {result}", file=sys.stderr, flush=True)
        return None
    facts, force = result.summary, result.force[:, 0]
    depth = max((row["largest_penetration"] for row in facts["contact"]), default=0.0) / thickness
    found = Run(force, facts["steps"], facts["newton_iterations"], depth, len(intersecting(result.shape)), seconds)
    print(f"{law} {factor:g}: {len(force)} states, {force[-1]:.6g} N, {found[1:]}", file=sys.stderr, flush=True)
    return found


def cases(kind: str) -> Iterator[dict[str, Any]]:
    """Cases of a kind; Miura sheets are at least 100 um thick."""
    if kind == "zigzag":
        return iter([closing_zigzag(0.5e-3, 0.0), closing_zigzag(1e-4, 0.3)])
    if kind == "tube":
        return iter([tomllib.loads((Path(__file__).parents[2] / "folding_cases" / "z_tube" / "case.toml").read_text())])
    drawn = (packed_miura(seed)[0] for seed in itertools.count())
    return (case for case in drawn if case["sheet"]["thickness"] >= 1e-4)


def print_rows(kind: str, sheets: int, factors: list[float]) -> None:
    """Rows of all laws and factors; cases without contact are left out."""
    table: dict[tuple[str, float], list[tuple[float, Run] | None]] = {(law, x): [] for law in _LAWS for x in factors}
    touching = ((case, limit) for case in cases(kind) if (limit := run(case, "linear", 1e4)) and limit.depth > 0.0)
    for case, limit in itertools.islice(touching, sheets if kind == "miura" else None):
        runs = {key: run(case, *key) for key in table}
        # the last saved state may be at the force limit, at another travel in each run
        at = _PACKED if kind == "tube" else min(len(each.force) for each in (limit, *runs.values()) if each) - 2
        largest = np.abs(limit.force[: at + 1]).max()
        for key, each in runs.items():
            table[key].append((float(abs(each.force[at] - limit.force[at]) / largest), each) if each else None)
    for (law, factor), row in table.items():
        found = [each for _, each in filter(None, row)]
        errors = [error for error, _ in filter(None, row)] or [np.nan]
        sums = " | ".join(f"{sum(each[k] for each in found):.0f}" for k in (1, 2, 4, 5))
        print(
            f"| {kind} | {law} | {factor:g} | {len(found)} of {len(row)} | {np.median(errors):.1e} | {max(errors):.1e} | "
            f"{max((each.depth for each in found), default=np.nan):.2g} | {sums} |",
            flush=True,
        )


def main() -> None:
    """Table of all kinds of cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", nargs="*", choices=_KINDS, default=_KINDS)
    parser.add_argument("--sheets", type=int, default=10, help="number of Miura sheets that touch themselves")
    parser.add_argument("--factors", nargs="*", type=float, default=[0.01, 1.0, 10.0, 100.0, 1000.0])
    given = parser.parse_args()
    print(f"Largest error of force and slopes of the barrier, against differences: {largest_difference():.1e}\n")
    solved(closing_zigzag(0.5e-3, 0.3))  # compiles the kernels
    results = "solved | median error | largest error | penetration/thickness | steps | iterations | intersecting | time (s)"
    print(f"| cases | law | factor | {results} |\n|{'---|' * 11}")
    for kind in given.cases:
        print_rows(kind, given.sheets, given.factors)


if __name__ == "__main__":
    main()
