"""What a run gives: records in time, what does not change, and both together as a `Solution`."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fsm.errors import CaseError
from fsm.results.array import ArrayMotion
from fsm.results.curve import Curve
from fsm.results.film import Film, Floats, Integers, Samples

__all__ = ["ENERGIES", "PAIRS", "Floats", "Integers", "Layout", "Record", "Solution"]

ENERGIES: dict[str, str] = {
    "kinetic": "kinetic energy",
    "panels": "elastic energy of the plain panels",
    "creases": "elastic energy of the creases",
    "bars": "elastic energy of the bars of a scissor array",
    "hinges": "elastic energy of its hinges and end stops",
    "film": "elastic energy of the film",
    "patch": "elastic energy of the patches of the film",
    "cable": "elastic energy of the cables",
    "contact": "elastic energy of the contacts",
    "gravity": "potential energy of gravity and of dead loads",
    "drives": "elastic energy of the drives",
    "dissipated": "energy dissipated since the start",
    "work": "work done from outside since the start",
    "error": "what the balance of all others is off by",
}
"""The energies of a record, J, and what each one is."""

PAIRS: dict[str, tuple[str, str]] = {
    "pair_force": ("N", "sum of the normal forces of the pair"),
    "pair_gap": ("m", "smallest gap of the pair, negative where the faces penetrate"),
    "pair_area": ("m^2", "area of the face of the pair that touches"),
    "pair_friction": ("N", "sum of the magnitudes of the friction forces of the pair"),
    "pair_slip": ("m/s", "mean slip speed of the pair, weighted by the normal forces"),
    "pair_friction_power": ("W", "power dissipated by the friction of the pair"),
    "pair_damping_power": ("W", "power dissipated by the damping of the normal forces of the pair"),
    "pair_friction_energy": ("J", "energy dissipated by the friction of the pair since the start, over all steps"),
    "pair_damping_energy": ("J", "energy dissipated by that damping since the start, over all steps"),
}
"""What a record has of every contact pair: unit, and what it is. All but gap and energies are 0 where nothing touches."""


@dataclass
class Record:
    """One saved state.

    Attributes
    ----------
    time : s
    q, u : (nq,), (nu,) arrays
        Configuration and velocity as the system defines them.
    travel, force : (n_drives,) arrays, m, N
        How far each drive has gone, and its reaction along its direction (a pull is positive).
    energy : dict of float, J
        Keys of `ENERGIES`; one that is left out is zero.
    pair_force, pair_gap, ... : (n_pairs,) arrays
        Of every contact pair; see `PAIRS`.
    shape : (n_quads, 4, 3) array, m
        Corner points of every plate a person would see, in turn around it: (start, -y), (end, -y), (end, +y),
        (start, +y), where start and end are along the x axis of the plate.
    negative_pivots : int
        Of the tangent; more than zero means an unstable equilibrium.
    """

    time: float
    q: Floats
    u: Floats
    travel: Floats
    force: Floats
    energy: dict[str, float]
    pair_force: Floats
    pair_gap: Floats
    pair_area: Floats
    pair_friction: Floats
    pair_slip: Floats
    pair_friction_power: Floats
    pair_damping_power: Floats
    pair_friction_energy: Floats
    pair_damping_energy: Floats
    shape: Floats
    negative_pivots: int = 0


@dataclass(frozen=True)
class Layout:
    """What does not change during a run.

    Attributes
    ----------
    case_text : the case file as it was solved, TOML
    provenance : versions, hashes, command, machine, wall time
    dimension : "planar" or "spatial"
    body_names, pair_names, drive_names : tuples of str
        Pairs are named by their two surfaces, drives by what they pull.
    panel : (n_quads,) array of int
        Panel number of every quad of the shape, from 1; 0 for a quad of no panel. Of a film, the number of the patch.
    thickness : m
    film : of a tensioned film, the state that it vibrates about
    """

    case_text: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    dimension: Literal["planar", "spatial"] = "planar"
    body_names: tuple[str, ...] = ()
    panel: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    pair_names: tuple[str, ...] = ()
    drive_names: tuple[str, ...] = ()
    thickness: float = 0.0
    film: Film | None = None

    @cached_property
    def case(self) -> dict[str, Any]:
        """The case as it was solved, as TOML has it.

        Raises
        ------
        CaseError
            It is damaged.
        """
        try:
            return tomllib.loads(self.case_text)
        except tomllib.TOMLDecodeError as error:
            raise CaseError(f"the case in this result is damaged: {error}") from None


@dataclass
class Solution:
    """A run: the fields of `Record`, each stacked over time, and what goes with them.

    Attributes
    ----------
    time, q, u, travel, force, pair_force, pair_gap, ..., shape, negative_pivots : arrays, first axis time
        Units as in `Record` and `PAIRS`.
    energy : dict of (n,) arrays, J
        All keys of `ENERGIES`.
    samples : Samples
        Probes of a film, between the records.
    layout : Layout
    stats : dict
        Steps, iterations, factorisations, ... of the solver.
    summary : dict
        Named results: peak_force, peak_travel, stages, ...
    array : ArrayMotion
        Points and bars of a scissor array at the records; None of anything else, or in a run that did not finish.
    curve : force curve
        With the points between the records, thinned; None without a drive, or in a run that did not finish.
    """

    time: Floats
    q: Floats
    u: Floats
    travel: Floats
    force: Floats
    energy: dict[str, Floats]
    pair_force: Floats
    pair_gap: Floats
    pair_area: Floats
    pair_friction: Floats
    pair_slip: Floats
    pair_friction_power: Floats
    pair_damping_power: Floats
    pair_friction_energy: Floats
    pair_damping_energy: Floats
    shape: Floats
    negative_pivots: Integers
    samples: Samples = field(default_factory=Samples)
    layout: Layout = field(default_factory=Layout)
    stats: dict[str, Any] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    array: ArrayMotion | None = None
    curve: Curve | None = None

    def __len__(self) -> int:
        return len(self.time)

    @classmethod
    def from_records(
        cls,
        records: Sequence[Record],
        layout: Layout,
        stats: dict[str, Any] | None = None,
        summary: dict[str, Any] | None = None,
    ) -> Solution:
        """Stack records; at least one is needed, since sizes come from them."""
        if not records:
            raise ValueError("a solution needs at least one record")
        stacked: dict[str, Any] = stack(records)
        return cls(
            **stacked,
            energy=stack_energies(records),
            negative_pivots=np.array([r.negative_pivots for r in records], dtype=np.int64),
            layout=layout,
            stats=dict(stats or {}),
            summary=dict(summary or {}),
        )


def stack_energies(records: Sequence[Record]) -> dict[str, Floats]:
    """The energies of records as arrays over time, by name: zero where a record leaves one out, and none without a name."""
    unknown = {name for r in records for name in r.energy} - ENERGIES.keys()
    if unknown:
        raise ValueError(f"energies that no result has a place for: {', '.join(sorted(unknown))}")
    return {name: np.array([r.energy.get(name, 0.0) for r in records], dtype=float) for name in ENERGIES}


def stack(records: Sequence[Record]) -> dict[str, Floats]:
    """The float fields of records as arrays over time, by field name."""
    names = ("time", "q", "u", "travel", "force", *PAIRS, "shape")
    return {name: np.array([getattr(r, name) for r in records], dtype=float) for name in names}
