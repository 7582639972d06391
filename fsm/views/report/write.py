"""Writing of the report: results to data, data and libraries to one HTML page."""

from __future__ import annotations

import base64
import html
import importlib.util
import io
import secrets
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from fsm.errors import CaseError, FsmError
from fsm.io.atomic_write import atomic_write
from fsm.io.provenance import fsm_version
from fsm.results.find import find_results
from fsm.results.solution import Solution
from fsm.results.store import read_solution
from fsm.views.plots.parts import lattice_squares
from fsm.views.plots.style import COLOURS, evolution
from fsm.views.report import fields
from fsm.views.report.compare import comparison
from fsm.views.report.packing import compressed, pack_doubles, pack_floats, pack_integers, safe_json
from fsm.views.report.plots import curves_of, travel_scale
from fsm.views.report.shapes import creases_of, parts_of, shown_shapes
from fsm.views.report.tables import sections_of

_THREE_BEGIN, _THREE_END = "<script>", 'Object.defineProperty(t,"__esModule",{value:!0})}));'
"""Begin and end of three.js in the viewer page of trimesh."""


class MissingLibrary(FsmError):
    """A package with a JavaScript library is not installed, or has another layout."""

    exit_code = 2


def _plotly(folder: Path) -> str:
    return (folder / "package_data" / "plotly.min.js").read_text(encoding="utf-8")


def _three(folder: Path) -> str:
    with zipfile.ZipFile(io.BytesIO((folder / "resources" / "templates" / "viewer.zip").read_bytes())) as archive:
        page = archive.read("viewer.html.template").decode("utf-8")
    begin = page.index(_THREE_BEGIN) + len(_THREE_BEGIN)
    return page[begin : page.index(_THREE_END, begin) + len(_THREE_END)]


_READERS: dict[str, tuple[str, Callable[[Path], str]]] = {"plotly": ("plotly", _plotly), "three": ("trimesh", _three)}


def library(name: str) -> str:
    """Source text of a JavaScript library, "plotly" or "three".

    Raises
    ------
    MissingLibrary
        Its package is not installed, or does not contain the library where it is expected.
    """
    package, read = _READERS[name]
    found = importlib.util.find_spec(package)
    if found is None or not found.submodule_search_locations:
        raise MissingLibrary(f"the package {package} is not installed; a report needs it: pip install {package}")
    try:
        return read(Path(next(iter(found.submodule_search_locations))))
    except (OSError, ValueError, LookupError, zipfile.BadZipFile) as error:
        text = f"the package {package} does not contain {name}.js where it is expected ({error}); install it again"
        raise MissingLibrary(text) from error


SHAPES, CHANNELS = 3_500_000, 1_500_000
"""Bytes of a page for the shapes and for the channels of all results together."""
MOST_PLAYED = 40
"""Largest number of results with shapes; further results are in the comparison only."""
_SCRIPTS = ("unpack.js", "rods.js", "player.js", "camera.js", "curves.js", "tables.js", "report.js", "live.js", "start.js")


def write_report(given: Sequence[str], out: str | Path, wanted: Sequence[str] = (), title: str = "") -> Path:
    """Write the page of one or several results.

    Parameters
    ----------
    given : result files, or folders with them
    out : HTML file
    wanted : patterns of channels that are always included
    title : title of the page; default: the title of the case

    Raises
    ------
    CaseError
        A result is missing or damaged, or `out` is not the name of an HTML file.
    """
    out = Path(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise CaseError(f'"{out.name}" is not the name of a page; give a name that ends in .html', "--out")
    solutions = {name: _read(path) for name, path in find_results(given).items()}
    page = report_page(solutions, wanted, title)
    out.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(out) as part:
        part.write_text(page, encoding="utf-8")
    return out


def _read(path: Path) -> Solution:
    """Result with a case that can be read and at least one record; errors name the file."""
    solution = read_solution(path)
    if not len(solution):
        raise CaseError("has no records yet", str(path))
    try:
        _ = solution.layout.case
    except CaseError as error:
        raise CaseError(error.faults, str(path)) from None
    return solution


def report_page(solutions: Mapping[str, Solution], wanted: Sequence[str] = (), title: str = "") -> str:
    """HTML page of results by name."""
    played = max(1, min(len(solutions), MOST_PLAYED))
    results = [
        result_data(name, solution, SHAPES // played if number < played else 0, CHANNELS // played, wanted)
        for number, (name, solution) in enumerate(solutions.items())
    ]
    first = next(iter(solutions.values()))
    title = title or str(first.layout.case.get("title") or next(iter(solutions)))
    if len(solutions) > 1:
        title = f"{title} and {len(solutions) - 1} more"
    return _page(title, _data(title, results) | {"compare": comparison(solutions)})


def live_page(title: str) -> str:
    """HTML page of a run that is not finished; it requests data from its own server only."""
    return _page(title, _data(title, []) | {"compare": None}, live=True)


def _data(title: str, results: list[dict[str, Any]]) -> dict[str, Any]:
    maps = {name: _colour_map(name) for name in ("viridis", "RdBu_r")}
    return {"title": title, "version": fsm_version(), "results": results, "palette": list(COLOURS), "maps": maps}


def result_data(name: str, solution: Solution, shapes: int, channels: int, wanted: Sequence[str] = ()) -> dict[str, Any]:
    """Data of a result for the page, with bounds for the bytes of shapes and channels."""
    label, factor = travel_scale(solution)
    travel = solution.travel[:, 0] if solution.travel.shape[1] else None
    names = solution.layout.step_names
    by = evolution(solution)[1]
    over = "record" if by.startswith("step") else "time" if by == "time (s)" else "travel"
    creases = creases_of(solution)
    every = fields.all_channels(solution, creases)
    listed, rows, left_out = fields.channel_data(every, wanted, channels if shapes else 0, len(solution))
    notes = [] if shapes else [f"The page has motion and curves for {MOST_PLAYED} results only, and not for this result."]
    if left_out:
        notes.append(
            f"{left_out} of {len(every)} channels are left out to keep the page small; --channel PATTERN includes them."
        )
    if len(rows) < len(solution):
        notes.append(f"Channels are shown at {len(rows)} of {len(solution)} records, equally spaced.")
    data: dict[str, Any] = {
        "name": name, "title": str(solution.layout.case.get("title") or name), "case": solution.layout.case_text,
        "time": pack_doubles(solution.time),
        "steps": pack_integers(np.clip(solution.step, 0, len(names))), "step_names": ["", *names],
        "travel": None if travel is None else pack_floats(factor * travel), "travel_label": label, "over": over,
        "plots": curves_of(solution) if shapes else [], "channels": listed, "channel_records": rows.tolist(),
        "sections": sections_of(solution),
    }  # fmt: skip
    if shapes and solution.shape.size:
        squares = lattice_squares(solution, solution.shape)
        solution = solution if squares is None else replace(solution, shape=squares)
        parts = parts_of(solution)
        shown = shown_shapes(solution, int(0.6 * shapes))
        named = zip(parts.names, parts.kinds, strict=True)
        owners = list(dict.fromkeys(entry["owner"] for entry in listed))
        notes += [shown.thinned] if shown.thinned else []
        data["player"] = shown.data | {
            "view": "iso" if squares is None else "front",
            "parts": [
                {"name": n, "kind": k, "owners": of}
                for n, k, of in zip(parts.names, parts.kinds, fields.owners_of_parts(named, owners), strict=True)
            ],
            "of_quad": pack_integers(parts.of_quad),
            "creases": [{"name": c.name, "corners": list(c.corners)} for c in creases],
            "colours": fields.colours_of(solution, parts, creases, every, shown.records),
            "contacts": fields.contact_marks(solution, parts, shown.records),
            "joints": fields.joints_of(every, creases, shown.records),
            "arrows": fields.arrows_of(solution, parts, creases, every, shown.records),
            "lines": [k == "cable" for k in parts.kinds],
        }
    data["notes"] = notes
    return data


def _colour_map(name: str) -> list[str]:
    colours = matplotlib.colormaps[name](np.linspace(0.0, 1.0, 33))
    return [matplotlib.colors.to_hex(colour) for colour in colours]


def _page(title: str, data: Mapping[str, Any], live: bool = False) -> str:
    """Page with embedded data, style, scripts and libraries.

    A policy in the page forbids all network access; a live page has access to its own server.
    """
    folder = files("fsm.views.report") / "page"
    nonce = base64.urlsafe_b64encode(secrets.token_bytes(12)).decode("ascii")
    filled = {
        "TITLE": html.escape(title, quote=True),
        "NONCE": nonce,
        "CONNECT": "'self'" if live else "'none'",
        "LIVE": ' data-live="true"' if live else "",
        "STYLE": (folder / "report.css").read_text(encoding="utf-8"),
        "DATA": safe_json(data),
        "THREE": compressed(library("three").encode()),
        "PLOTLY": compressed(library("plotly").encode()),
        "SCRIPT": "\n".join((folder / name).read_text(encoding="utf-8") for name in _SCRIPTS),
    }
    template = (folder / "report.html").read_text(encoding="utf-8")
    pieces = template.split("@@")
    return "".join(filled[piece] if k % 2 else piece for k, piece in enumerate(pieces))
