"""Figures of a study, and its page."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fsm.studies.problem import CURVE
from fsm.studies.result import RANDOM, StudyResult
from fsm.text.shown_units import shown as with_unit
from fsm.text.shown_units import shown_range
from fsm.views.plots.drawing import file_format
from fsm.views.plots.studies import Column, chosen_pairs, plot_fan, plot_indices, plot_scatter_matrix, plot_tornado
from fsm.views.report.figure_page import Block, write_page

_FIGURES = {
    "fan": "Force over travel: quantiles of all runs", "indices": "Sobol indices with intervals",
    "tornado": "Response at the ends of each parameter", "scatter": "Scatter matrix of parameters and responses",
}  # fmt: skip
_OF_FAILED = (
    "Failed runs have no response. Bands, indices and regressions come from the others, so they are biased if a cause "
    "belongs to a part of the range."
)
_OF_INDICES = (
    "First: part of the variance that a parameter causes alone; total: with all its interactions. Correlated parameters "
    "form one group."
)
_OF_SLOPES = (
    "Standardised slopes: standard deviations of the response for one standard deviation of the parameter. R² is the part "
    "of the variance that a straight line explains."
)


def write_figures_and_page(result: StudyResult, folder: Path, page: Path) -> None:
    """Draw the figures of a study and write its page."""
    drawn = {}
    for name in _FIGURES:
        for old in folder.glob(f"{name}.*"):
            old.unlink()
        if _draw(result, name, folder / f"{name}.png"):
            drawn[name] = folder / f"{name}.png"
            if file_format() != ".png":
                _draw(result, name, folder / f"{name}{file_format()}")
    write_page(page, result.file.title or f"Study of {result.source.stem}", _blocks(result, drawn))


def _draw(result: StudyResult, name: str, path: Path) -> bool:
    """Draw a figure; whether the study has it."""
    keys = [one.key for one in result.file.response]
    if name == "fan":
        travel, forces = result.curves()
        if len(forces) < 2:
            return False
        nominal = None
        if result.nominal.curve:
            nominal = np.linspace(0.0, result.nominal.travel, CURVE), np.array(result.nominal.curve)
        plot_fan(path, travel, forces, nominal, result.file.level if result.file.design.kind in RANDOM else None)
        return True
    if name == "indices":
        found = [(key, indices) for key in keys if (indices := result.indices(key)) is not None]
        charts = [(key, one.first, one.total, one.first_interval, one.total_interval) for key, one in found]
        if charts:
            plot_indices(path, result.groups, charts, result.file.level)
        return bool(charts)
    if name == "tornado":
        charts_of = [(key, result.nominal.units[key], _middle(result, key), result.tornado(key)) for key in keys]
        charts_of = [chart for chart in charts_of if np.isfinite(chart[3]).any()]
        how = "from runs at both ends" if result.design.varied is not None else "from the linear regression of all runs"
        names = [f"{one.path}\n{shown_range(one.low, one.high, one.unit)}" for one in result.scatters]
        if charts_of:
            plot_tornado(path, names, charts_of, how)
        return bool(charts_of)
    parameters = [Column(one.path, one.unit, result.design.values[:, k]) for k, one in enumerate(result.scatters)]
    responses = [Column(key, result.nominal.units[key], result.response(key)) for key in keys]
    if sum(np.isfinite(responses[0].values)) < 2:
        return False
    fitted = result.regression(keys[0])
    effect = np.ones(len(parameters)) if fitted is None else fitted.standardised
    plot_scatter_matrix(path, *chosen_pairs(parameters, responses, effect))
    return True


def _middle(result: StudyResult, key: str) -> float:
    if result.design.varied is not None:
        return result.nominal.responses[key]
    values = result.response(key)
    return float(np.nanmean(values)) if np.isfinite(values).any() else np.nan


def _blocks(result: StudyResult, drawn: dict[str, Path]) -> list[Block]:
    file, design = result.file, result.file.design
    level = f"{100 * file.level:g} %"
    band = f"{level} band" if design.kind in RANDOM else "range of the runs"
    responses = []
    for one in file.response:
        unit = result.nominal.units[one.key]
        low, middle, high = (_shown(value, unit) for value in result.quantiles(one.key))
        responses.append([one.key, _shown(result.nominal.responses[one.key], unit), middle, f"{low} to {high}"])
    notes = [f"Design: {design.kind}, {len(result.runs)} runs, {result.failed} of them failed; seed {file.seed}."]
    if design.kind not in RANDOM:
        notes.append("The runs of this design have no probabilities: bands are the range of the runs.")
    blocks = [
        Block("Responses", notes, [(["response", "nominal", "median", band], responses)], _of(drawn, "fan")),
        Block("Parameters", (), [(
            ["parameter", "nominal", "low end", "high end", "scatter"],
            [[s.path, *(_shown(x, s.unit) for x in (s.nominal, s.low, s.high)), s.text] for s in result.scatters],
        )]),
    ]  # fmt: skip
    if result.failed:
        rows = [
            [text, str(count), ", ".join(map(str, numbers[:20])) + (", ..." if count > 20 else "")]
            for text, count, numbers in result.causes()
        ]
        note = _OF_FAILED
        blocks.insert(1, Block("Failed runs", [note], [(["cause", "runs", "numbers in study.csv"], rows)]))
    blocks += _what_matters(result, drawn)
    if "scatter" in drawn:
        blocks.append(Block("Scatter matrix", (), (), _of(drawn, "scatter")))
    return blocks


def _what_matters(result: StudyResult, drawn: dict[str, Path]) -> list[Block]:
    """Tables of indices and regressions with their figures."""
    blocks = []
    tables, notes = [], []
    for one in result.file.response:
        found = result.indices(one.key)
        if found is None:
            continue
        rows = [
            [name, f"{s:.3f}", f"{a:.3f} to {b:.3f}", f"{t:.3f}", f"{c:.3f} to {d:.3f}"]
            for name, s, t, (a, b), (c, d) in zip(
                result.groups, found.first, found.total, found.first_interval, found.total_interval, strict=True
            )
        ]
        tables.append(([one.key, "first", "interval", "total", "interval"], rows))
        if found.lost:
            notes.append(
                f"{one.key}: {found.lost} of {found.lost + found.rows} rows of the base sample left out: a run failed."
            )
    if tables:
        text = _OF_INDICES
        blocks.append(Block("Sobol indices", [text, *notes], tables, _of(drawn, "indices")))
    fits = []
    for one in result.file.response:
        fitted = result.regression(one.key)
        if fitted is not None:
            rows = [
                [name, f"{b:+.3f}", f"{low:+.3f} to {high:+.3f}"]
                for name, b, (low, high) in zip(result.paths, fitted.standardised, fitted.interval, strict=True)
            ]
            fits.append(([f"{one.key} (R² = {fitted.determination:.3f})", "standardised slope", "interval"], rows))
    if fits or "tornado" in drawn:
        text = _OF_SLOPES
        blocks.append(Block("Regression and tornado", [text] if fits else [], fits, _of(drawn, "tornado")))
    return blocks


def _shown(value: float, unit: str) -> str:
    return with_unit(value, unit).strip() if np.isfinite(value) else "-"


def _of(drawn: dict[str, Path], name: str) -> list[tuple[Path, str]]:
    return [(drawn[name], _FIGURES[name])] if name in drawn else []
