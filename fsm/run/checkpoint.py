"""Checkpoints: points at which a run can restart, and their file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from fsm.analyses.analysis import States, StepResult
from fsm.results.checkpoint_file import write_checkpoint
from fsm.results.step_data import StepModes
from fsm.solve.interface.records import DriveState
from fsm.solve.interface.system import System
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, CurvePoint
from fsm.solve.outcome.status import Event

_STATE, _STATES, _MODES = "state_", "states_", "modes_"
"""Prefixes of the arrays of `AcceptedStep.state`, of the states at the beginning of the step, and of modes."""


@dataclass(frozen=True)
class RestartPoint:
    """Point at which a run can restart.

    Attributes
    ----------
    end : state of the solver
    energy_balance
    n_points : number of points of the curve
    written : numbers of records and samples
    step : number of the step, from 0
    states : states at the beginning of the step; None for the first step
    done : results of the steps before
    modes : modes that steps before have found
    """

    end: AcceptedStep
    energy_balance: EnergyBalance
    n_points: int
    written: tuple[int, int]
    step: int = 0
    states: States | None = None
    done: tuple[StepResult, ...] = ()
    modes: tuple[StepModes, ...] = field(default=())


def write_point(path: Path, point: RestartPoint, points: list[CurvePoint], attributes: dict[str, Any]) -> None:
    """Write a checkpoint with the points of the curve so far, and other attributes."""
    energy_balance = asdict(point.energy_balance)
    pair_energy = energy_balance.pop("pair_energy")
    state = point.end.state
    assert state is not None
    points = points[: point.n_points]
    modes = {
        f"{_MODES}{k}_{name}": values for k, found in enumerate(point.modes) for name, values in vars(found).items()
    }
    write_checkpoint(
        path,
        {
            **{f"{_STATE}{name}": values for name, values in state.items()},
            **{f"{_STATES}{name}": values for name, values in (point.states or {}).items()},
            **modes,
            "time": np.array([point.end.time]),
            "q": point.end.q,
            "u": point.end.u,
            "ledger": np.array(list(energy_balance.values())),
            "pair_energy": pair_energy,
            "travel": np.array([one.drive.travel for one in points]),
            "force": np.array([one.drive.force for one in points]),
            "pair_force": np.array([one.pair_force for one in points]),
            "point": np.array([one[2:] for one in points]),
        },
        {
            **attributes,
            "steps": point.end.steps,
            "records": point.written[0],
            "samples": point.written[1],
            "step": point.step,
            "done": json.dumps([asdict(one) for one in point.done]),
            "events": json.dumps([asdict(event) for event in point.end.events]),
        },
    )


def read_point(arrays: dict[str, np.ndarray], attributes: dict[str, Any]) -> tuple[RestartPoint, list[CurvePoint]]:
    """Restart point of a checkpoint that has been read, and the points of the curve."""
    points = list(_points(arrays))
    events = tuple(Event(**event) for event in json.loads(attributes["events"]))
    state = _with_prefix(arrays, _STATE)
    end = AcceptedStep(float(arrays["time"][0]), arrays["q"], arrays["u"], int(attributes["steps"]), events, state)
    energy_balance = EnergyBalance(*[*arrays["ledger"].tolist(), arrays["pair_energy"]])
    written = int(attributes["records"]), int(attributes["samples"])
    done = tuple(StepResult(**one) for one in json.loads(attributes["done"]))
    modes: list[StepModes] = []
    names = [one.name for one in fields(StepModes)]
    while f"{_MODES}{len(modes)}_step" in arrays:
        modes.append(StepModes(*(arrays[f"{_MODES}{len(modes)}_{name}"] for name in names)))
    states = _with_prefix(arrays, _STATES) or None
    step = int(attributes["step"])
    return RestartPoint(end, energy_balance, len(points), written, step, states, done, tuple(modes)), points


def check_point(
    system: System, arrays: dict[str, np.ndarray], attributes: dict[str, Any]
) -> None:
    """Raise a ValueError if the content of a checkpoint does not fit the system of its step."""
    q, u = system.initial()
    pairs = system.energy(0.0, q, u).pair_power
    shapes = {"time": (1,), "q": q.shape, "u": u.shape, "pair_energy": pairs.shape}
    shapes["ledger"] = (len(fields(EnergyBalance)) - 1,)
    for name, shape in shapes.items():
        if arrays[name].shape != shape or not np.all(np.isfinite(arrays[name])):
            raise ValueError(f"{name} is not finite, or its shape is not {shape}")
    if min(int(attributes[name]) for name in ("steps", "records", "samples", "step")) < 0:
        raise ValueError("steps, records, samples or step are negative")
    if not all(isinstance(text, str) for text in attributes["warnings"]):
        raise ValueError("a warning is not a string")


def _with_prefix(arrays: dict[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    return {name.removeprefix(prefix): values for name, values in arrays.items() if name.startswith(prefix)}


def _points(arrays: dict[str, np.ndarray]) -> Iterator[CurvePoint]:
    """Points of the curve in a checkpoint."""
    columns = arrays["travel"], arrays["force"], arrays["pair_force"], arrays["point"].tolist()
    for travel, force, pairs, (at, path, panels, creases) in zip(*columns, strict=True):
        yield CurvePoint(DriveState(travel, force), pairs, at, int(path), panels, creases)
