"""Files of a study: tables, numbers, figures, and one page with all of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from fsm.case.loading.table import PARQUET
from fsm.io.atomic_write import atomic_write
from fsm.io.csv_file import write_csv, write_parquet
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib
from fsm.io.hdf5_checked import fixed_text, written_from_memory
from fsm.io.json_values import finite_values
from fsm.io.provenance import provenance
from fsm.studies.problem import CURVE
from fsm.studies.result import RANDOM, StudyResult
from fsm.studies.search import heading_of

REPORT, TABLE, ARRAYS, PAGE = "study.json", "study.csv", "study.h5", "report.html"
"""Files of a study, beside `PARQUET`."""


def write_study(result: StudyResult, folder: Path, page: bool = True) -> None:
    """Write all files of a study into its folder; figures and page only if wanted."""
    _write_table(result, folder)
    _write_arrays(result, folder / ARRAYS)
    with atomic_write(folder / REPORT) as part:
        text = json.dumps(finite_values(contents(result)), indent=2, ensure_ascii=False, allow_nan=False)
        part.write_text(text + "\n", encoding="utf-8")
    if not page:
        return
    with imports_outside_gc(), plain_matplotlib():
        from fsm.studies.study_page import write_figures_and_page
    write_figures_and_page(result, folder, folder / PAGE)


def _write_table(result: StudyResult, folder: Path) -> None:
    """Write one row for each run, as CSV and Parquet: parameters with all digits, responses and the cause of a failure."""
    keys = [one.key for one in result.file.response]
    head = ["run", *(heading_of(one.path, one.unit) for one in result.scatters)]
    head += [*(heading_of(key, result.nominal.units[key]) for key in keys), "snaps", "error"]
    rows = [
        [
            number, *values, *([None if run is None else run.responses[key] for key in keys]),
            None if run is None else run.snaps, error,
        ]
        for number, (values, run, error) in enumerate(
            zip(result.design.values.tolist(), result.runs, result.errors, strict=True)
        )
    ]  # fmt: skip
    write_parquet(folder / PARQUET, head, lambda: rows)
    last = 1 + len(result.scatters)
    write_csv(folder / TABLE, head, ([row[0], *map(repr, row[1:last]), *row[last:]] for row in rows))


def _write_arrays(result: StudyResult, path: Path) -> None:
    """Write parameters (n, p), responses (n, r), ends of the travels (n,), and force curves (n, m) of all runs."""
    keys = [one.key for one in result.file.response]
    curves = np.full((len(result.runs), CURVE), np.nan, dtype=np.float32)
    for number, run in enumerate(result.runs):
        if run is not None and run.curve:
            curves[number] = run.curve
    with written_from_memory(path) as file:
        file.attrs["format"] = fixed_text("fsm study")
        file.attrs["version"] = 1
        for name, data, names, units in (
            ("parameters", result.design.values, result.paths, [one.unit for one in result.scatters]),
            (
                "responses",
                np.column_stack([result.response(key) for key in keys]),
                keys,
                [result.nominal.units[key] for key in keys],
            ),
        ):
            data = file.create_dataset(name, data=data)
            data.attrs["names"], data.attrs["units"] = fixed_text(names), fixed_text(units)
        file.create_dataset("travel_end", data=np.array([0.0 if run is None else run.travel for run in result.runs]))
        file.create_dataset("force", data=curves, compression="gzip")


def contents(result: StudyResult) -> dict[str, Any]:
    """Content of study.json: seed, scatter, and for each response quantiles, indices and regression; causes of failures."""
    file = result.file
    return {
        "study": str(result.source),
        "title": file.title,
        "design": file.design.model_dump(mode="json"),
        "seed": file.seed,
        "level": file.level,
        "runs": len(result.runs),
        "failed": [{"cause": text, "count": count, "runs": numbers} for text, count, numbers in result.causes()],
        "parameters": [
            {
                "path": one.path,
                "unit": one.unit,
                "nominal": one.nominal,
                "low": one.low,
                "high": one.high,
                "scatter": one.text,
            }
            for one in result.scatters
        ],
        "responses": {one.key: _response(result, one.key) for one in file.response},
        "provenance": provenance(),
    }


def _response(result: StudyResult, key: str) -> dict[str, Any]:
    low, middle, high = result.quantiles(key)
    values = result.response(key)
    good = values[np.isfinite(values)]
    found: dict[str, Any] = {
        "unit": result.nominal.units[key], "nominal": result.nominal.responses[key],
        "low": low, "median": middle, "high": high, "band": result.file.level if result.file.design.kind in RANDOM else None,
        "mean": good.mean() if len(good) else None, "standard_deviation": good.std(ddof=1) if len(good) > 1 else None,
        "ends": dict(zip(result.paths, result.tornado(key).tolist(), strict=True)),
    }  # fmt: skip
    indices, fitted = result.indices(key), result.regression(key)
    if indices is not None:
        found["sobol"] = {
            "rows": indices.rows, "lost": indices.lost,
            "groups": {
                name: {"first": s, "first_interval": list(bs), "total": t, "total_interval": list(bt)}
                for name, s, t, bs, bt in zip(
                    result.groups, indices.first, indices.total, indices.first_interval, indices.total_interval, strict=True
                )
            },
        }  # fmt: skip
    if fitted is not None:
        found["regression"] = {
            "determination": fitted.determination,
            "standardised": {
                name: {"slope": b, "interval": list(bounds)}
                for name, b, bounds in zip(result.paths, fitted.standardised, fitted.interval, strict=True)
            },
        }
    return found
