"""Second solution of a case: another method, a finer mesh or a full model, and a comparison of the key numbers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fsm.results.store import read_solution
from validation.stress.dice import Tables
from validation.stress.second import difference_of

__all__ = ["Other", "compared", "otherwise", "worst"]

UNSTATED = 0.02
"""Error of a peak, a frequency, a stress or a motion, part of it, where the program states none."""
_MESH = {"frequency_hz": "mesh_error_frequency", "amplitude_center": "mesh_error_amplitude"}
"""Errors of its mesh that the summary of a film states."""
_STATED = ("reduced_error", "reduced_error_struck", "reduced_force_error")
"""Errors that the summary of a film states, of its reduced model against the full one, over the displacement of that."""
_OF_AMPLITUDE = ("step_error", "point_force_error")
"""Errors that it states of the largest displacement by the full model."""
_PERIODS = 3.0
"""Periods of the free motion, at least, from which the summary states a frequency without a warning."""
_TIGHT = "1e-6"
"""Relative tolerance of Radau-blocks, of which a run is an order better than generalized-alpha at the default."""


@dataclass(frozen=True)
class Other:
    """Changed settings, in the form of `--set`, and a name for them."""

    settings: tuple[str, ...]
    by: str


def otherwise(kind: str, tables: Tables, method: str) -> Other:
    """The same case for another solver, or on a finer mesh; `method` solved it first."""
    if kind in ("strips", "lattices") and method == "static":
        drive = tables["drive"][0]
        if kind == "strips" and "body" not in drive:
            segments = 2 * tables["strip"]["segments_per_panel"]
            return Other((f"strip.segments_per_panel={segments}",), f"{segments} segments per panel")
        increment = float(drive["travel"].split()[0]) / 1000.0
        return Other((f"solve.increment={increment:.12g} mm", "solve.rtol=1e-8"), "increments of a thousandth at rtol 1e-8")
    if kind == "films":
        if method == "modal":
            return Other(("vibration.model=full", "solve.rtol=1e-5"), "full model")
        along, across = (round(1.5 * count) for count in tables["membrane"]["mesh"])
        return Other((f"membrane.mesh=[{along}, {across}]",), f"mesh of {along} x {across}")
    if kind == "deployed":
        along, across = (
            tables.get("deployed", {}).get("elements_per_panel", 4),
            tables.get("deployed", {}).get("elements_across", 6),
        )
        finer = (f"deployed.elements_per_panel={round(1.5 * along)}", f"deployed.elements_across={round(1.5 * across)}")
        return Other(finer, f"{round(1.5 * along)} x {round(1.5 * across)} elements a panel")
    if kind in ("sheets", "packed"):
        return _other_sheet(tables)
    if kind == "arrays":
        finer = ("scissor.elements_per_bar=8", "solve.rtol=1e-7", "solve.max_steps=2000000")
        return Other(finer, "8 elements a bar at rtol 1e-7")
    return Other(("solve.method=Radau-blocks", f"solve.rtol={_TIGHT}"), f"Radau-blocks at rtol {_TIGHT}")


def _other_sheet(tables: Tables) -> Other:
    """Flexible facets on a finer mesh; other sheets with other steps, or by the path by arc length if loads act alone."""
    sheet = tables["sheet"]
    if "mesh" in sheet:
        mesh = [round(1.5 * count) for count in sheet["mesh"]]
        return Other((f"sheet.mesh={mesh}",), f"mesh of {mesh[0]} x {mesh[1]}")
    if "mesh_size" in sheet:
        size = float(sheet["mesh_size"].split()[0]) / 1.5
        return Other((f"sheet.mesh_size={size:.6g} mm",), f"mesh size of {size:.3g} mm")
    if "drive" not in tables:
        step = "1 s" if "fold_to" in sheet else "2 ms"
        return Other((f"solve.max_step={step}", "solve.rtol=1e-8"), f"steps of {step}")
    increment = float(tables["drive"][0]["travel"].split()[0]) / 1000.0
    return Other((f"solve.increment={increment:.6g} mm", "solve.rtol=1e-8", "solve.method=static"), "small increments")


def compared(kind: str, first: Path, second: Path, rtol: float) -> list[tuple[str, float, float]]:
    """Key numbers of two runs: name, relative difference, and tolerance."""
    one, two = (json.loads((folder / "summary.json").read_text(encoding="utf-8")) for folder in (first, second))
    loads = _loads(first, second) if kind == "sheets" else []
    packed = list(_volumes(first, second)) if kind == "packed" else []
    return list(_numbers(kind, one, two)) + list(_motions(kind, first, second, rtol)) + loads + packed


def _volumes(first: Path, second: Path) -> Iterator[tuple[str, float, float]]:
    """Volume of the gas at the end."""
    one, two = (read_solution(folder / "result.h5").channels for folder in (first, second))
    for name in one:
        if name.startswith("gas.") and name.endswith(".volume"):
            a, b = float(one[name].values[-1]), float(two[name].values[-1])
            yield "volume of the gas", abs(a - b) / max(abs(a), 1e-300), UNSTATED


def _loads(first: Path, second: Path) -> list[tuple[str, float, float]]:
    """Displacement of the first load at the end."""
    ends = []
    for folder in (first, second):
        if not (folder / "load.csv").is_file():
            return []
        ends.append(float((folder / "load.csv").read_text(encoding="utf-8").splitlines()[-1].split(",")[5]))
    return [("displacement of the load", abs(ends[0] - ends[1]) / max(abs(ends[0]), 1e-300), UNSTATED)]


def worst(found: list[tuple[str, float, float]]) -> tuple[str, float, float]:
    """Number with the largest difference relative to its tolerance."""
    return max(found, key=lambda item: item[1] / item[2])


def _numbers(kind: str, one: Mapping[str, Any], two: Mapping[str, Any]) -> Iterator[tuple[str, float, float]]:
    peak = abs(one.get("peak_force") or 0.0)
    segments = UNSTATED + (one.get("mesh_error") or 0.0)
    if peak:
        yield "peak_force", abs(one["peak_force"] - two["peak_force"]) / peak, segments
    # a last state that the summary calls unstable moves to another state, so its force is not compared
    moving = one.get("unstable_at_end") or two.get("unstable_at_end")
    if kind in ("strips", "lattices", "sheets", "packed") and peak and one.get("final_force") is not None and not moving:
        off = abs(one["final_force"] - two["final_force"]) / max(peak, abs(one["final_force"]))
        yield "final_force", off, UNSTATED + (one.get("mesh_error_final") or 0.0)
    for step, other in zip(one.get("step", ()), two.get("step", ()), strict=False):
        largest = max(step.get("frequencies_hz", ()), default=0.0)
        for i, (a, b) in enumerate(zip(step.get("frequencies_hz", ()), other.get("frequencies_hz", ()), strict=False)):
            yield f"mode {i + 1}", abs(a - b) / largest, UNSTATED
    for name, place in one.get("probe_displacement", {}).items():
        way = max(*map(abs, place), 1e-300)
        apart = max(abs(a - b) for a, b in zip(place, two["probe_displacement"][name], strict=True))
        yield f"probe {name}", apart / way, UNSTATED
    for name in ("least", "median") if one.get("folded") else ():
        yield f"folded {name}", abs(one["folded"][name] - two["folded"][name]), UNSTATED
    for i, (a, b) in enumerate(zip((one.get("modes_hz") or ())[:3], two.get("modes_hz") or (), strict=False)):
        yield f"mode {i + 1}", abs(a - b) / abs(a), UNSTATED + ((one.get("mesh_error_modes") or [0.0] * 3)[i] or 0.0)
    stated = UNSTATED + max((one.get(name) or 0.0) for name in _STATED)
    for name, mesh in _MESH.items():
        if one.get(name) and two.get(name):
            # the highest of several lines may differ, but the line itself must exist in both
            others = (two.get("lines_hz") or [two[name]]) if name == "frequency_hz" else [two[name]]
            whole = two[name] if one.get("method") == "modal" else one[name]
            allowed = stated + (one.get(mesh) or 0.0)
            if name == "frequency_hz" and one[name] < _PERIODS * (one.get("frequency_resolution_hz") or 0.0):
                continue  # the summary warns that the motion is too short for a frequency
            if name == "amplitude_center":
                allowed += sum(one.get(error) or 0.0 for error in _OF_AMPLITUDE)
            yield name, min(abs(one[name] - other) for other in others) / abs(whole), allowed
    if one.get("max_stress") and two.get("max_stress"):
        apart = abs(one["max_stress"] - two["max_stress"]) / one["max_stress"]
        yield "max_stress", apart, UNSTATED + (one.get("max_stress_error") or 0.0)


def _motions(kind: str, first: Path, second: Path, rtol: float) -> Iterator[tuple[str, float, float]]:
    """Differences of all motions, relative to the largest displacement."""
    if kind not in ("strips", "released", "scenes", "arrays"):
        return
    one, two = (read_solution(folder / "result.h5") for folder in (first, second))
    if kind == "strips" and one.travel.shape[1]:  # a pull is judged by its forces
        return
    if one.array is None or two.array is None:
        stated = json.loads((first / "summary.json").read_text(encoding="utf-8")).get("motion_error") or 0.0
        yield "motion", difference_of(one, two, rtol), UNSTATED + stated
        return
    _, a, b = np.intersect1d(one.time, two.time, return_indices=True)
    places, others = one.array.points.displacement[a], two.array.points.displacement[b]
    way = float(np.abs(places).max())
    yield "motion", float(np.abs(places - others).max()) / way if way else 0.0, UNSTATED
