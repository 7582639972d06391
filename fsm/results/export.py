"""Results for other programs: the force curve and the contacts as CSV."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np

from fsm.atomic_write import atomic_write
from fsm.results.curve import Curve
from fsm.results.quantities import sliding_distance, touching_pairs
from fsm.results.solution import ENERGIES, Floats, Solution

__all__ = ["force_columns", "write_contact_csv", "write_force_csv", "write_history_csv", "write_points_csv"]


def force_columns(solution: Solution, energies: bool = False, dynamic: bool = False) -> dict[str, Floats]:
    """The columns of the force curve by their headings, units in brackets.

    One drive: ``travel (m)``, ``force (N)``, ``time (s)``. Several: travel and force of each, by name. No
    drive: the time alone. The points are those of the curve that are quasi-static, or with `dynamic` those that are
    not; all, where none is quasi-static. `energies` adds all energies, which only records have.
    """
    names = solution.layout.drive_names
    curve = Curve.of(replace(solution, curve=None) if energies or not solution.travel.shape[1] else solution)
    if curve.has_quasi_static:
        curve = curve.at(curve.dynamic == dynamic)
    columns: dict[str, Floats] = {}
    for k in range(curve.travel.shape[1]):
        of = f" of {names[k] if k < len(names) else f'drive {k + 1}'}" if curve.travel.shape[1] > 1 else ""
        columns[f"travel{of} (m)"] = curve.travel[:, k]
        columns[f"force{of} (N)"] = curve.force[:, k]
    columns["time (s)"] = curve.time
    if energies:
        columns |= {f"energy {name} (J)": solution.energy[name] for name in ENERGIES}
    return columns


def write_force_csv(solution: Solution, path: str | Path, energies: bool = False, dynamic: bool = False) -> None:
    """Write the force curve, one point a row, 12 significant digits; see `force_columns` for the columns."""
    columns = force_columns(solution, energies, dynamic)
    rows = np.column_stack(list(columns.values()))
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([f"{value:.12g}" for value in row] for row in rows)


def write_contact_csv(solution: Solution, path: str | Path) -> None:
    """Write the contacts, a row for each record and each pair that ever touches, 12 significant digits.

    Columns: ``travel (m)`` of the first drive, if there is one, ``time (s)``, ``pair``, and what is known of the pair.
    """
    columns = {
        "normal force (N)": solution.pair_force,
        "gap (m)": solution.pair_gap,
        "area (m^2)": solution.pair_area,
        "friction (N)": solution.pair_friction,
        "slip speed (m/s)": solution.pair_slip,
        "sliding distance (m)": sliding_distance(solution.time, solution.pair_slip),
        "friction energy (J)": solution.pair_friction_energy,
        "damping energy (J)": solution.pair_damping_energy,
    }
    when = {"travel (m)": solution.travel[:, 0]} if solution.travel.shape[1] else {}
    when["time (s)"] = solution.time
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*when, "pair", *columns])
        for record in range(len(solution)):
            begin = [f"{values[record]:.12g}" for values in when.values()]
            for k in touching_pairs(solution.pair_force):
                values = [f"{of[record, k]:.12g}" for of in columns.values()]
                writer.writerow([*begin, solution.layout.pair_names[k], *values])


def write_points_csv(solution: Solution, path: str | Path) -> None:
    """Write the points of a scissor array, one record a row, 12 significant digits.

    Columns: ``time (s)``, and of every point ``a1 x (m)``, ``a1 y (m)`` (places), ``a1 vx (m/s)``, ..., ``a1 ay (m/s^2)``.
    """
    motion = solution.array
    if motion is None:
        raise ValueError("the result is not of a scissor array that finished")
    columns: dict[str, Floats] = {"time (s)": solution.time}
    places = motion.start + motion.points.displacement
    for k, name in enumerate(motion.point_names):
        for letter, unit, values in (
            ("", "m", places),
            ("v", "m/s", motion.points.velocity),
            ("a", "m/s^2", motion.points.acceleration),
        ):
            columns |= {f"{name} {letter}{axis} ({unit})": values[:, k, i] for i, axis in enumerate("xy")}
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([f"{value:.12g}" for value in row] for row in np.column_stack(list(columns.values())))


def write_history_csv(solution: Solution, path: str | Path) -> None:
    """Write the probes of a film: ``time (s)`` and ``<probe> x (m)``, y, z of each, a sample a row, 12 digits."""
    film = solution.layout.film
    if film is None:
        raise ValueError("this result has no probes")
    heading = ["time (s)", *(f"{name} {axis} (m)" for name in film.probe_names for axis in "xyz")]
    rows = np.column_stack([solution.samples.time, solution.samples.displacement.reshape(len(solution.samples.time), -1)])
    with atomic_write(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heading)
        writer.writerows([f"{value:.12g}" for value in row] for row in rows)
