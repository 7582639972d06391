"""Results of a run in memory: records over time, constant data, and both combined as a `Solution`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from fsm.errors import CaseError
from fsm.results.array import ArrayMotion
from fsm.results.channel import Channel, ChannelInfo
from fsm.results.curve import ForceCurve
from fsm.results.film import Film, Floats, Integers, ProbeSamples
from fsm.results.step_data import LoadPath, StepModes
from fsm.text.short_repr import ShortRepr
from fsm.text.shown_units import travel_text

FILM, LINE, BEAM, LINK, JOINT_AXIS = range(-1, -6, -1)
"""Values of `panel` for other quads of a scene: films, lines of cables (quads without width), beams, lines of bodies without
a shape, and lines along axes of joints."""

ENERGIES: dict[str, str] = {
    "kinetic": "kinetic energy",
    "panels": "elastic energy of the plain panels",
    "creases": "elastic energy of the creases",
    "bars": "elastic energy of the bars of a scissor array",
    "hinges": "elastic energy of the hinges and end stops of a scissor array",
    "film": "elastic energy of the film",
    "patch": "elastic energy of the patches of the film",
    "cable": "elastic energy of the cables",
    "beam": "elastic energy of the beams",
    "contact": "elastic energy of the contacts",
    "gas": "energy of gas in chambers, and of the surroundings that it displaces",
    "gravity": "potential energy of gravity and of dead loads",
    "drives": "elastic energy of the drives",
    "dissipated": "energy dissipated since the start",
    "numerical": "energy dissipated by the steps in time, due to their finite size, since the start",
    "work": "work of external forces since the start",
    "error": "energy balance residual",
}
"""Energies of a record, J, with their descriptions."""

_MOST_NAMED = 3
"""Largest number of drives and of channels that the text of a solution names."""

PAIRS: dict[str, tuple[str, str]] = {
    "pair_force": ("N", "sum of the normal forces of the pair"),
    "pair_gap": ("m", "smallest gap of the pair, negative where the faces penetrate"),
    "pair_area": ("m^2", "contact area of the pair"),
    "pair_friction": ("N", "sum of the magnitudes of the friction forces of the pair"),
    "pair_slip": ("m/s", "mean slip speed of the pair, weighted by the normal forces"),
    "pair_friction_power": ("W", "power dissipated by the friction of the pair"),
    "pair_damping_power": ("W", "power dissipated by the damping of the normal forces of the pair"),
    "pair_friction_energy": ("J", "energy dissipated by the friction of the pair since the start, over all steps"),
    "pair_damping_energy": ("J", "energy dissipated by the damping of the normal forces since the start, over all steps"),
}
"""Quantities of every contact pair in a record: unit and description. Without contact, all quantities except gap and
energies are 0."""

MAY_BE_INFINITE = (*PAIRS, "memory")
"""Records with numbers that may be not finite: gaps of pairs far apart, and times of latches that are still open."""
FLOATS = ("time", "q", "u", "travel", "force", *PAIRS, "shape", "program_time", "memory")
"""Fields of a record that are numbers or arrays of numbers."""
INTEGERS = ("negative_pivots", "step")
"""Fields of a record that are integers."""


@dataclass(repr=False)
class _Fields(ShortRepr):
    """Fields of a record; in a solution they are stacked over time."""

    time: Any
    q: Floats
    u: Floats
    travel: Floats
    force: Floats
    energy: Any
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


@dataclass(repr=False)
class Record(_Fields):
    """Saved state of the structure at one time.

    Attributes
    ----------
    time : s
    q, u : (nq,), (nu,) arrays
        Configuration and velocity as the system defines them.
    travel, force : (n_drives,) arrays, m, N
        Travel of each drive, and its reaction along its direction.
    energy : dict of float, J
        Keys of `ENERGIES`; an absent energy is zero.
    pair_force, pair_gap, ... : (n_pairs,) arrays
        Quantities of every contact pair; see `PAIRS`.
    shape : (n_quads, 4, 3) array, m
        Corner points of every visible plate, in the order (start, -y), (end, -y), (end, +y), (start, +y).
        Start and end are the ends along the x axis of the plate.
    negative_pivots : int
        Negative pivots of the tangent stiffness; a positive number means an unstable equilibrium.
    channels : dict of arrays
        Values of the channels of the layout, by name.
    step : int
        Number of the step of the run, from 1.
    program_time : s
        Time at which loads and drives are evaluated. The program time differs from `time` on a path by arc length; absent:
        `time`.
    memory : (n_memory,) array
        Internal variables of the elements: multipliers of locked directions, turns, hysteresis, latches; those of a step
        with fewer elements are followed by zeros.
    """

    time: float
    energy: dict[str, float]
    negative_pivots: int = 0
    channels: dict[str, Floats] = field(default_factory=dict)
    step: int = 1
    program_time: float = math.nan
    memory: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if math.isnan(self.program_time):
            self.program_time = self.time


@dataclass(frozen=True, repr=False)
class Layout(ShortRepr):
    """Data of a run that are constant in time.

    Attributes
    ----------
    case_text : TOML text of the case that was solved
    provenance : versions, hashes, command, machine, wall time
    dimension : "planar" or "spatial"
    body_names, pair_names, drive_names : tuples of str
        Pairs are named by their two surfaces, drives by the part that they pull.
    panel : (n_quads,) array of int
        Panel number of every quad of the shape, from 1; 0 for a quad without panel. For a film, the number of the patch;
        in a scene FILM, LINE, BEAM, LINK and JOINT_AXIS.
    thickness : m
    film : tensioned equilibrium of a film; None for other structures
    channels : descriptions of the recorded channels
    step_names : names of the steps of the run; empty in older files
    quad_names : name of the body, film, cable, beam or bar of every quad; empty in older files
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
    channels: tuple[ChannelInfo, ...] = ()
    step_names: tuple[str, ...] = ()
    quad_names: tuple[str, ...] = ()

    def turns(self, drive: int = 0) -> bool:
        """Whether a drive turns bodies: its travel is an angle (rad), its force a moment (N m)."""
        return drive < len(self.drive_names) and self.drive_names[drive].endswith("(turn)")

    def travel_text(self, travel: float) -> str:
        """Travel (m) or turn (rad) of the first drive, for messages."""
        text = travel_text(self.turns(), travel)
        return text if text.endswith("turns") else f"{text} of {'turn' if self.turns() else 'travel'}"

    @cached_property
    def case(self) -> dict[str, Any]:
        """Case that was solved, as a dict of its TOML keys.

        Raises
        ------
        CaseError
            The text is damaged.
        """
        try:
            return tomllib.loads(self.case_text)
        except tomllib.TOMLDecodeError as error:
            raise CaseError(f"the case in this result is damaged: {error}") from None


@dataclass(repr=False)
class Solution(_Fields):
    """Complete result of a run: the fields of `Record` stacked over time, and data of the whole run.

    Attributes
    ----------
    time, q, u, travel, force, pair_force, pair_gap, ..., shape, negative_pivots : arrays, first axis time
        Units as in `Record` and `PAIRS`.
    energy : dict of (n,) arrays, J
        All keys of `ENERGIES`.
    samples : Samples
        Samples of the probes of a film; empty for other structures.
    layout : Layout
    stats : dict
        Steps, iterations, factorisations, ... of the solver.
    summary : dict
        Named results: peak_force, peak_travel, stages, ...
    array : ArrayMotion or None
        Points and bars of a scissor array at the records; None for other structures and in an unfinished run.
    curve : Curve or None
        Force curve at the steps of the solver, decimated; None without a drive and in an unfinished run.
    channels : dict of Channel
        Recorded channels by name, see `[save] channels` of a case.
    step : (n,) array of int
        Number of the step of every record, from 1; 0 in older files.
    modes : StepModes or None
        Natural modes that steps have found.
    program_time : (n,) array, s
        Times at which loads and drives are taken; NaN in older files.
    load_path : LoadPath or None
        Loads at all points of paths by arc length.
    memory : (n, n_memory) array
        Internal variables of the elements, see `Record`; (n, 0) in older files. `fsm.Result.system` uses them.
    """

    time: Floats
    energy: dict[str, Floats]
    negative_pivots: Integers
    samples: ProbeSamples = field(default_factory=ProbeSamples)
    layout: Layout = field(default_factory=Layout)
    stats: dict[str, Any] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    array: ArrayMotion | None = None
    curve: ForceCurve | None = None
    channels: dict[str, Channel] = field(default_factory=dict)
    step: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    modes: StepModes | None = None
    program_time: Floats = field(default_factory=lambda: np.zeros(0))
    load_path: LoadPath | None = None
    memory: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"Solution({self._span()}; {self._parts()})"

    def __str__(self) -> str:
        lines = [f"solution    {self._span()}", f"structure   {self.layout.dimension}, {self._parts()}"]
        for number, name in enumerate(self.layout.drive_names[:_MOST_NAMED]):
            unit = "N m" if self.layout.turns(number) else "N"
            low, high = (bound(self.force[:, number], initial=0.0) for bound in (np.min, np.max))
            lines.append(f"drive       {name}: {low:.4g} to {high:.4g} {unit}")
        if self.channels:
            named = ", ".join(list(self.channels)[:_MOST_NAMED]) + (", ..." if len(self.channels) > _MOST_NAMED else "")
            lines.append(f"channels    {len(self.channels)}: {named}")
        return "\n".join(lines)

    def _span(self) -> str:
        return f"{len(self)} records from {self.time[0]:.4g} to {self.time[-1]:.4g} s" if len(self) else "no record"

    def _parts(self) -> str:
        """Numbers of the parts, in words."""
        counts = {
            "drawn facet": self.shape.shape[1] if self.shape.ndim > 1 else 0,
            "velocity component": self.u.shape[1] if self.u.ndim > 1 else 0,
            "drive": len(self.layout.drive_names),
            "contact pair": len(self.layout.pair_names),
            "channel": len(self.channels),
            "natural mode": 0 if self.modes is None else len(self.modes.frequency),
            "load path point": 0 if self.load_path is None else len(self.load_path.time),
        }
        return ", ".join(f"{count} {word}{'s' if count > 1 else ''}" for word, count in counts.items() if count)

    @property
    def force_curve(self) -> ForceCurve:
        """Force curve at the steps of the solver; at the records if the solution has no other."""
        if self.curve is not None:
            return self.curve
        energy, path = self.energy, np.zeros(len(self), dtype=np.int64)
        return ForceCurve(self.travel, self.force, self.pair_force, self.time, path, energy["panels"], energy["creases"])

    @classmethod
    def from_records(cls, records: Sequence[Record], layout: Layout) -> Solution:
        """Stack records over time."""
        return cls.from_rows(stack(records, layout), layout)

    @classmethod
    def from_rows(cls, rows: Mapping[str, Any], layout: Layout) -> Solution:
        """Solution of records that `stack` has stacked."""
        values = dict(rows)
        return cls(
            energy={name: values.pop(name) for name in ENERGIES},
            channels={info.name: Channel(info, values.pop(info.name)) for info in layout.channels},
            layout=layout,
            **values,
        )

    @property
    def rows(self) -> dict[str, Any]:
        """Arrays over time, by the names of `stack`."""
        values = {name: getattr(self, name) for name in (*FLOATS, *INTEGERS)}
        return values | self.energy | {name: channel.values for name, channel in self.channels.items()}


def stack(records: Sequence[Record], layout: Layout) -> dict[str, Any]:
    """Fields of records as arrays over time: `FLOATS`, `INTEGERS`, energies and channels by name.

    An energy that a record does not have is zero.
    """
    names = {name for r in records for name in r.energy}
    energy = {name: [r.energy.get(name, 0.0) for r in records] for name in names}
    channels = {info.name: [r.channels[info.name] for r in records] for info in layout.channels}
    return stacked({name: [getattr(r, name) for r in records] for name in (*FLOATS, *INTEGERS)}, energy, channels)


def stacked(values: Mapping[str, Any], energy: Mapping[str, Any], channels: Mapping[str, Any]) -> dict[str, Any]:
    """`stack` of fields, energies and channels whose values over time are known."""
    unknown = energy.keys() - ENERGIES.keys()
    if unknown:
        raise ValueError(f"unknown energies in a record: {', '.join(sorted(unknown))}")
    rows: dict[str, Any] = {name: np.array(values[name], dtype=float) for name in FLOATS}
    rows |= {name: np.array(values[name], dtype=np.int64) for name in INTEGERS}
    none = np.zeros(len(rows["time"]))
    rows |= {name: np.array(energy.get(name, none), dtype=float) for name in ENERGIES}
    return rows | {name: np.array(of, dtype=float) for name, of in channels.items()}
