"""Curves of one result for the page: force, energies, contact map, channels of films and arrays, spectra."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from fsm.results.array import asynchronism
from fsm.results.film import Floats, Integers
from fsm.results.quantities import CONTACT_THRESHOLD, contact_rows, touching_pairs
from fsm.results.solution import Solution
from fsm.results.spectrum import spectrum
from fsm.text.load_names import load_units
from fsm.text.shown_units import count
from fsm.views.plots import style
from fsm.views.plots.channels import report_diagrams
from fsm.views.plots.energy import STACK
from fsm.views.plots.load import load_axes
from fsm.views.report.packing import pack_doubles, pack_floats

MOST_POINTS = 3000
"""Approximate largest number of points of a curve; the extremes of each interval are kept."""
_MAP_PAIRS, _MAP_RECORDS = 60, 600
_PROBES = 8


def travel_scale(solution: Solution) -> tuple[str, float]:
    """Label of the travel of the first drive and its factor from SI."""
    unit = style.drive_units(solution)[1]
    return style.travel_label(solution.layout.turns(), unit), unit.factor


def decimated(values: Sequence[Floats], limit: int = MOST_POINTS) -> Integers:
    """Points of curves (n,) to keep: both ends, and the extremes of every curve in each interval."""
    length = len(values[0])
    if length <= limit:
        return np.arange(length)
    size = max(2, -(-2 * len(values) * length // limit))
    keep = {0, length - 1}
    for start in range(0, length, size):
        for one in values:
            part = np.nan_to_num(one[start : start + size])
            keep |= {start + int(part.argmin()), start + int(part.argmax())}
    return np.array(sorted(keep))


def curves_of(solution: Solution) -> list[dict[str, Any]]:
    """Plots of a result in their order on the page."""
    makers = (
        _report,
        _force,
        _load_path,
        _energy,
        _balance,
        _contact_map,
        _history,
        _spectrum,
        _modes,
        _points,
        _synchronism,
        _stress,
    )
    return [plot for make in makers for plot in make(solution)]


def _plot(
    key: str,
    title: str,
    alt: str,
    ylabel: str,
    solution: Solution,
    lines: Sequence[dict[str, Any]],
    time: Floats,
    travel: Floats | None,
    **more: Any,
) -> dict[str, Any]:
    """Plot of lines over time or travel; each line is a dict with `name` and `y`."""
    rows = decimated([line["y"] for line in lines])
    data: dict[str, Any] = {
        "key": key, "title": title, "alt": alt, "ylabel": ylabel, "time": pack_doubles(time[rows]), "rows": len(time),
        "lines": [{**line, "y": pack_floats(line["y"][rows])} for line in lines], **more,
    }  # fmt: skip
    if travel is not None:
        label, factor = travel_scale(solution)
        data |= {"travel": pack_floats(factor * travel[rows]), "travel_label": label}
    return data


def _travel(solution: Solution) -> Floats | None:
    return solution.travel[:, 0] if solution.travel.shape[1] else None


def _report(solution: Solution) -> Iterator[dict[str, Any]]:
    """Channels of `report` and reactions of joints over time."""
    for number, ((unit, quantity), columns) in enumerate(report_diagrams(solution).items()):
        shown = style.figure_unit(unit, [*columns.values()])
        lines = [_line(style.shortened(name), shown.factor * values, k) for k, (name, values) in enumerate(columns.items())]
        title = quantity[0].upper() + quantity[1:]
        alt = f"{title} over time: {', '.join(columns)}."
        named = quantity if unit == "1" else f"{quantity} ({shown.name})"
        yield _plot(f"report-{number}", title, alt, named, solution, lines, solution.time, None)


def _force(solution: Solution) -> Iterator[dict[str, Any]]:
    """Drive forces over travel, or contact forces over time without a drive."""
    curve, layout = solution.force_curve, solution.layout
    if not solution.travel.shape[1]:
        pairs = touching_pairs(solution.pair_force)[: len(style.COLOURS) * 3]
        lines = [_line(layout.pair_names[k], solution.pair_force[:, k], k) for k in pairs]
        if lines:
            largest = f"largest {style.rounded(solution.pair_force.max())} N"
            alt = f"Normal forces of {count(len(pairs), 'contact pair')} over time; {largest}."
            yield _plot("force", "Contact forces", alt, "normal force (N)", solution, lines, solution.time, None)
        return
    quasi_static = curve.has_quasi_static
    effort, unit = style.drive_units(solution)[0]
    lines = []
    for k in range(curve.force.shape[1]):
        name = style.shortened(layout.drive_names[k]) if k < len(layout.drive_names) else f"drive {k + 1}"
        whole = effort * curve.force[:, k]
        force = np.where(curve.dynamic, np.nan, whole) if quasi_static else whole
        lines.append(_line(name, force, k))
        if quasi_static and curve.dynamic.any():
            edges = np.flatnonzero(np.diff(curve.dynamic.astype(int)))
            moving = curve.dynamic.copy()
            moving[edges], moving[edges + 1] = True, True
            lines.append({"name": f"{name}, dynamic", "y": np.where(moving, whole, np.nan), "thin": True})
    summary = style.summary_with_stages(solution)
    factor = style.drive_units(solution)[1].factor
    marks = [_mark("peak", factor * summary["peak_travel"], effort * summary["peak_force"], unit)]
    events = [event for event in summary.get("events", ()) if event["kind"] in style.EVENTS]
    marks += [_mark(style.EVENTS[e["kind"]][1], factor * e["travel"], effort * e["force"], unit) for e in events]
    begins = [factor * float(stage["travel"]) for stage in summary["stages"]]
    ends = [*begins[1:], factor * float(curve.travel[:, 0].max())]
    stages = [
        {"name": str(stage["name"]), "from": begin, "to": end, "colour": colour, "opacity": opacity}
        for stage, begin, end in zip(summary["stages"], begins, ends, strict=True)
        for colour, opacity in [style.stage_shade(stage)]
    ]
    at = f"{style.rounded(factor * summary['peak_travel'])} {style.drive_units(solution)[1].name}"
    drives = "the drive" if len(layout.drive_names) == 1 else f"{len(layout.drive_names)} drives"
    what = "Moment" if layout.turns() else "Force"
    alt = f"{what} of {drives} over travel; peak {style.rounded(effort * summary['peak_force'])} {unit} at {at}."
    finite = curve.force[~curve.dynamic] if quasi_static else curve.force
    limits = [effort * float(np.nanmin(finite)), effort * float(np.nanmax(finite))]
    yield _plot(
        "force", "Moment over turn" if layout.turns() else "Force over travel", alt,
        f"{'moment' if layout.turns() else 'force'} ({unit})", solution, lines, curve.time, curve.travel[:, 0],
        marks=marks, stages=stages, limits=limits if quasi_static and curve.dynamic.any() else None,
    )  # fmt: skip


def _mark(name: str, travel: float, force: float, unit: str) -> dict[str, Any]:
    return {"name": name, "x": float(travel), "y": float(force), "text": f"{name}: {style.rounded(force)} {unit}"}


def _line(name: str, values: Floats, number: int) -> dict[str, Any]:
    return {"name": name, "y": np.asarray(values, dtype=float), "colour": number}


def _load_path(solution: Solution) -> Iterator[dict[str, Any]]:
    """Loads over their displacements on paths by arc length and of static steps."""
    path = solution.load_path
    if path is None:
        return
    kinds = load_axes(path)
    lines, sizes = [], []
    for k, name in enumerate(path.names):
        way, size = kinds[load_units(name)]
        sizes.append(size.factor * path.size[:, k])
        lines.append({"name": name, "x": pack_floats(way.factor * path.way[:, k]), "y": pack_floats(sizes[k]), "colour": k})
    unstable = path.negative_modes > 0
    if unstable.any():
        for k, name in enumerate(path.names):
            part = pack_floats(np.where(unstable, sizes[k], np.nan))
            lines.append({"name": f"{name}, unstable", "x": lines[k]["x"], "y": part, "css": "#D55E00"})
    at_records = len(path.time) == len(solution) and len(path.names) == 1
    cursor = {"time": pack_doubles(solution.time), "x": lines[0]["x"]} if at_records else None
    across = " or ".join(f"{kind.curve} ({way.name})" for kind, (way, _) in kinds.items())
    up = " or ".join(f"{kind.load} ({size.name})" for kind, (_, size) in kinds.items())
    yield {
        "key": "load", "title": "Load over displacement", "ylabel": up, "lines": lines, "xlabel": across,
        "alt": f"Load-displacement path of {count(len(path.names), 'load')} with {count(len(path.time), 'point')}, "
        f"{int(unstable.sum())} of them unstable.",
        **({"cursor": cursor} if cursor else {}),
    }  # fmt: skip


def _energy(solution: Solution) -> Iterator[dict[str, Any]]:
    """Energy changes since the start, stacked, and the work."""
    if len(solution) < 2:
        return
    changes = {name: solution.energy[name] - solution.energy[name][0] for name in STACK}
    work = solution.energy["work"] - solution.energy["work"][0]
    factor, unit = style.figure_unit("J", [*changes.values(), work])
    largest = max(float(np.abs(values).max()) for values in changes.values())
    shown = {name: factor * values for name, values in changes.items() if np.any(np.abs(values) > 1e-9 * largest)}
    if not shown:
        return
    lines: list[dict[str, Any]] = []
    for name, values in shown.items():
        label, colour = STACK[name]
        for side, part in (("gain", np.maximum(values, 0.0)), ("loss", np.minimum(values, 0.0))):
            if side == "gain" or np.any(part < 0.0):
                lines.append({"name": label, "y": part, "css": colour, "stack": side})
    released = factor * -sum(np.minimum(values, 0.0) for values in changes.values())
    visible = np.any(released > 1e-3 * np.abs(factor * work).max())
    lines.append({"name": "work and released energy" if visible else "work", "y": factor * work + released, "dash": True})
    alt = f"Energy changes since the start; work at the end {style.rounded(factor * work[-1])} {unit}."
    yield _plot(
        "energy", "Energies since the start", alt, f"energy ({unit})", solution, lines, solution.time, _travel(solution)
    )


def _balance(solution: Solution) -> Iterator[dict[str, Any]]:
    """Energy balance residual."""
    residual = solution.energy["error"]
    if len(solution) < 2 or not np.any(residual):
        return
    factor, unit = style.figure_unit("J", residual)
    largest = float(np.abs(residual).max())
    alt = f"Energy balance residual; largest magnitude {style.rounded(factor * largest)} {unit}."
    lines = [_line("energy balance residual", factor * residual, 1)]
    title = "Energy balance residual"
    yield _plot("balance", title, alt, f"residual ({unit})", solution, lines, solution.time, _travel(solution))


def _contact_map(solution: Solution) -> Iterator[dict[str, Any]]:
    """Normal force of every pair that touches, as colours over time or travel."""
    pairs, of_pairs, _ = contact_rows(solution)
    if not pairs:
        return
    shown = sorted(sorted(range(len(pairs)), key=lambda k: -float(of_pairs[:, k].max()))[:_MAP_PAIRS])
    rows = np.unique(np.linspace(0, len(solution) - 1, min(len(solution), _MAP_RECORDS)).astype(np.int64))
    force = of_pairs[rows][:, shown].T
    force = np.where(force > CONTACT_THRESHOLD * of_pairs.max(), force, 0.0)  # the same stages as in contact.png
    names = [pairs[k] for k in shown]
    label, factor = travel_scale(solution)
    data: dict[str, Any] = {
        "key": "contact", "title": "Contact map", "kind": "map", "names": names, "values": pack_floats(force),
        "time": pack_doubles(solution.time[rows]), "ylabel": "normal force (N)",
        "note": "" if len(shown) == len(pairs) else f"{len(shown)} of {len(pairs)} rows, those with the largest forces.",
        "alt": f"Normal forces of {count(len(shown), 'contact pair')}; largest {style.rounded(float(force.max()))} N.",
    }  # fmt: skip
    travel = _travel(solution)
    if travel is not None:
        data |= {"travel": pack_floats(factor * travel[rows]), "travel_label": label}
    yield data


def _history(solution: Solution) -> Iterator[dict[str, Any]]:
    """Displacement of the probes of a film."""
    film, samples = solution.layout.film, solution.samples
    if film is None or len(samples.time) < 2:
        return
    unit = style.figure_unit("m", samples.displacement[:, :_PROBES, 2])
    moved = unit.factor * samples.displacement[:, :, 2]
    lines = [_line(name, moved[:, k], k) for k, name in enumerate(film.probe_names[:_PROBES])]
    largest = max(float(np.abs(line["y"]).max()) for line in lines)
    alt = f"Displacement normal to the film of {count(len(lines), 'probe')}; largest {style.rounded(largest)} {unit.name}."
    title = "Displacement of the probes"
    yield _plot("history", title, alt, f"normal displacement ({unit.name})", solution, lines, samples.time, None)


def _spectrum(solution: Solution) -> Iterator[dict[str, Any]]:
    """Amplitude spectra of the probes after the load, and the natural frequencies."""
    film, samples = solution.layout.film, solution.samples
    if film is None or len(samples.time) < 16:
        return
    end = float(solution.summary.get("free_from") or 0.0)
    begin = int(np.searchsorted(samples.time, end))
    if len(samples.time) - begin < 8:
        return
    unit = style.figure_unit("m", samples.displacement[begin:, :_PROBES, 2])
    highest = 1.2 * float(np.abs(film.frequency).max(initial=0.0)) or np.inf
    lines = []
    for k, name in enumerate(film.probe_names[:_PROBES]):
        found = spectrum(samples.time[begin:], unit.factor * samples.displacement[begin:, k, 2])
        use = (found.frequency > 0.0) & (found.frequency <= highest)
        keep = np.flatnonzero(use)[decimated([found.amplitude[use]])] if use.any() else np.zeros(0, dtype=np.int64)
        lines.append(
            {"name": name, "x": pack_floats(found.frequency[keep]), "y": pack_floats(found.amplitude[keep]), "colour": k}
        )
    yield {
        "key": "spectrum", "title": "Spectrum", "lines": lines, "xlabel": "frequency (Hz)",
        "ylabel": f"amplitude ({unit.name})", "log": True,
        "verticals": [float(f) for f in film.frequency if f > 0.0],
        "alt": f"Amplitude spectra of {count(len(lines), 'probe')}; {len(film.frequency)} natural frequencies as ticks.",
    }  # fmt: skip


def _modes(solution: Solution) -> Iterator[dict[str, Any]]:
    """Natural frequencies of a film and of steps as bars; a bar selects its mode in the player."""
    groups: list[tuple[str, Floats]] = []
    if solution.layout.film is not None and len(solution.layout.film.frequency):
        groups.append(("film", solution.layout.film.frequency))
    if solution.modes is not None:
        for step in np.unique(solution.modes.step).tolist():
            names = solution.layout.step_names
            label = names[step - 1] if 0 < step <= len(names) else f"step {step}"
            groups.append((label, solution.modes.frequency[solution.modes.step == step]))
    if groups:
        lines = [
            {"name": name, "x": list(range(1, len(f) + 1)), "y": f.tolist(), "colour": k}
            for k, (name, f) in enumerate(groups)
        ]
        yield {
            "key": "modes", "title": "Natural frequencies", "kind": "bars", "lines": lines, "xlabel": "mode",
            "ylabel": "frequency (Hz); negative: unstable",
            "alt": "Natural frequencies: " + ", ".join(f"{f:.4g}" for f in groups[0][1][:10]) + " Hz.",
        }  # fmt: skip


def _points(solution: Solution) -> Iterator[dict[str, Any]]:
    """Displacements of the upper points of a scissor array."""
    array = solution.array
    if array is None:
        return
    lines, unit = [], style.figure_unit("m", array.points.displacement)
    for number, name in enumerate(array.upper[:_PROBES]):
        k = array.point_index(name)
        for axis, letter in enumerate("xy"):
            values = unit.factor * array.points.displacement[:, k, axis]
            lines.append({**_line(f"{name} {letter}", values, number), "dash": axis == 0})
    alt = f"Displacements of {len(array.upper)} upper points of the array over time."
    label = f"displacement ({unit.name})"
    yield _plot("points", "Displacement of the upper points", alt, label, solution, lines, solution.time, None)


def _synchronism(solution: Solution) -> Iterator[dict[str, Any]]:
    """Difference in deployment of neighbouring units."""
    array = solution.array
    if array is None or len(array.upper) < 3:
        return
    apart = asynchronism(array)
    unit = style.figure_unit("m", [*apart.values()])
    lines = [_line(name, unit.factor * values, k) for k, (name, values) in enumerate(apart.items())]
    if lines:
        alt = f"Difference in deployment of {count(len(lines), 'pair')} of neighbouring points."
        yield _plot(
            "synchronism",
            "Difference in deployment of neighbours",
            alt,
            f"difference ({unit.name})",
            solution,
            lines,
            solution.time,
            None,
        )


def _stress(solution: Solution) -> Iterator[dict[str, Any]]:
    """Largest normal stress of the bars of an array."""
    array = solution.array
    if array is None or not array.stress.shape[1]:
        return
    unit = style.figure_unit("Pa", array.stress)
    lines = [_line(name, unit.factor * array.stress[:, k], k) for k, name in enumerate(array.bar_names)]
    most = f"{style.rounded(unit.factor * float(array.stress.max()))} {unit.name}"
    alt = f"Largest normal stresses of {count(len(lines), 'bar')}; largest {most}."
    yield _plot("stress", "Largest stress of the bars", alt, f"stress ({unit.name})", solution, lines, solution.time, None)
