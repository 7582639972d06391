"""CSV files of a result: force curve, contacts, points of an array, probes of a film."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fsm.io.csv_file import write_csv
from fsm.results.film import Floats
from fsm.results.quantities import sliding_distance, touching_pairs
from fsm.results.solution import ENERGIES, Solution


def force_columns(solution: Solution, energies: bool = False, dynamic: bool = False) -> dict[str, Floats]:
    """Columns of the force curve by heading, with the unit in brackets.

    With one drive the columns are ``travel (m)``, ``force (N)`` and ``time (s)``.
    With several drives each one has its travel and force, by name. Without a drive the time is the only column.

    Parameters
    ----------
    solution : Solution
    energies : bool
        Add all energies. The points are the records then, because only records have all energies.
    dynamic : bool
        Select the dynamic points instead of the quasi-static ones. A curve without quasi-static points is not filtered.
    """
    names = solution.layout.drive_names
    at_records = energies or not solution.travel.shape[1]
    curve = (replace(solution, curve=None) if at_records else solution).force_curve
    if curve.has_quasi_static:
        curve = curve.select(curve.dynamic == dynamic)
    columns: dict[str, Floats] = {}
    for k in range(curve.travel.shape[1]):
        of = f" of {names[k] if k < len(names) else f'drive {k + 1}'}" if curve.travel.shape[1] > 1 else ""
        turns = solution.layout.turns(k)
        columns[f"turn{of} (rad)" if turns else f"travel{of} (m)"] = curve.travel[:, k]
        columns[f"moment{of} (N m)" if turns else f"force{of} (N)"] = curve.force[:, k]
    columns["time (s)"] = curve.time
    if energies:
        columns |= {f"energy {name} (J)": solution.energy[name] for name in ENERGIES}
    return columns


def when_columns(solution: Solution) -> dict[str, Floats]:
    """Travel (m) of the first drive, or its turn (rad), and time (s) of the records, by heading."""
    columns: dict[str, Floats] = {}
    if solution.travel.shape[1]:
        columns["turn (rad)" if solution.layout.turns() else "travel (m)"] = solution.travel[:, 0]
    return columns | {"time (s)": solution.time}


def write_force_csv(solution: Solution, path: str | Path, energies: bool = False, dynamic: bool = False) -> None:
    """Write the force curve with one point per row and 12 significant digits; see `force_columns` for the columns."""
    columns = force_columns(solution, energies, dynamic)
    write_csv(path, columns, np.column_stack(list(columns.values())))


def write_contact_csv(solution: Solution, path: str | Path) -> None:
    """Write the contacts: one row per record and pair that ever touches, with 12 significant digits.

    The columns are those of `when_columns`, ``pair``, and the quantities of the pair.
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
    when, touching = when_columns(solution), touching_pairs(solution.pair_force)
    names = [solution.layout.pair_names[k] for k in touching]
    instants = np.repeat(np.column_stack(list(when.values())), len(names), axis=0)
    records = np.stack([of[:, touching] for of in columns.values()], axis=-1).reshape(len(instants), -1)
    write_csv(path, [*when, "pair", *columns], np.hstack([instants, records]), names, instants.shape[1])


def write_points_csv(solution: Solution, path: str | Path) -> None:
    """Write the points of a scissor array with one record per row and 12 significant digits.

    The columns are ``time (s)`` and, for every point, its position, velocity and acceleration:
    ``a1 x (m)``, ``a1 y (m)``, ``a1 vx (m/s)``, ..., ``a1 ay (m/s^2)``.

    Raises
    ------
    ValueError
        The result is not a finished run of a scissor array.
    """
    motion = solution.array
    if motion is None:
        raise ValueError("the result is not a finished run of a scissor array")
    columns: dict[str, Floats] = {"time (s)": solution.time}
    places = motion.start + motion.points.displacement
    for k, name in enumerate(motion.point_names):
        for letter, unit, values in (
            ("", "m", places),
            ("v", "m/s", motion.points.velocity),
            ("a", "m/s^2", motion.points.acceleration),
        ):
            columns |= {f"{name} {letter}{axis} ({unit})": values[:, k, i] for i, axis in enumerate("xy")}
    write_csv(path, columns, np.column_stack(list(columns.values())))


def write_history_csv(solution: Solution, path: str | Path) -> None:
    """Write the probes of a film with one sample per row and 12 significant digits.

    The columns are ``time (s)`` and, for every probe, ``<probe> x (m)``, ``<probe> y (m)`` and ``<probe> z (m)``.

    Raises
    ------
    ValueError
        The result is not of a film.
    """
    film = solution.layout.film
    if film is None:
        raise ValueError("the result has no probes: it is not of a film")
    heading = ["time (s)", *(f"{name} {axis} (m)" for name in film.probe_names for axis in "xyz")]
    rows = np.column_stack([solution.samples.time, solution.samples.displacement.reshape(len(solution.samples.time), -1)])
    write_csv(path, heading, rows)
