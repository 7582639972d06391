"""Case of the pulled sheet: the whole sheet or a part of it between lines of symmetry, and its force over the extension."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

import fsm

__all__ = ["EXTENSION", "PERIODS", "ROWS", "SPACING", "Sheet", "curve", "sheet_case"]

PERIODS, ROWS, SPACING = 5, 31, 3.8e-3
"""Periods across the sheet, rows of slits, and their distance (m)."""
SLIT, LIGAMENT = 17.2e-3, 4.4e-3
EXTENSION = 73e-3
"""Largest extension of the whole sheet, m."""


@dataclass(frozen=True)
class Sheet:
    """Model of the sheet.

    Attributes
    ----------
    mesh_size : m
    grading : of the cells towards the ends of slits, `mesh_grading`
    half_width : whether the middle of the width is a plane of symmetry of the model
    half_length : line across the middle of the length: "rotation" by half a turn about this line (all rows tilt in one
        sense), "mirror" (both halves tilt in opposite senses), or None, the whole length
    thickness, young, slit_width : m, Pa, m
    clear : distance of the clamps from the first and the last row, m
    gravity : acceleration normal to the sheet, m/s^2
    contact : whether the sheet touches itself
    periods, rows : of the whole sheet; rows must be odd
    extension : m
    """

    mesh_size: float = 1.9e-3
    grading: float = 0.0
    half_width: bool = True
    half_length: Literal["rotation", "mirror"] | None = "rotation"
    thickness: float = 0.1e-3
    young: float = 4e9
    slit_width: float = 0.0
    clear: float = SPACING
    gravity: float = 0.0
    contact: bool = False
    periods: float = PERIODS
    rows: int = ROWS
    extension: float = EXTENSION

    @property
    def sides(self) -> int:
        """Number of parts of the sheet beside each other across its width."""
        return 2 if self.half_width else 1

    @property
    def parts(self) -> int:
        """Number of parts of the sheet in a row along its length."""
        return 2 if self.half_length else 1


def sheet_case(sheet: Sheet) -> dict[str, Any]:
    """Case of a model, clamped at the edge "bottom", which moves away from the other end."""
    middle = sheet.half_length is not None
    supports: list[dict[str, Any]] = [{"at": "edge bottom", "fixed": ["x", "z"], "clamped": True}]
    if sheet.half_length == "rotation":
        supports.append({"at": "edge top", "fixed": ["y", "z"]})  # this line turns by half a turn into itself
    elif sheet.half_length == "mirror":
        supports.append({"at": "edge top", "mirror": "y"})
    else:
        supports.append({"at": "edge top", "clamped": True})
    if sheet.half_width:
        supports.append({"at": "edge right", "mirror": "x"})
    travel = sheet.extension / sheet.parts
    case: dict[str, Any] = {
        "title": "Kirigami sheet, pulled",
        "gravity": [0.0, 0.0, -sheet.gravity],
        "sheet": {
            "kind": "slits", "periods": sheet.periods / sheet.sides, "rows": (sheet.rows + 1) // 2 if middle else sheet.rows,
            "spacing": SPACING, "slit_length": SLIT, "ligament": LIGAMENT, "slit_width": sheet.slit_width,
            "margin": [sheet.clear, 0.0 if middle else sheet.clear], "facets": "flexible", "mesh_size": sheet.mesh_size,
            "mesh_grading": [sheet.grading, sheet.grading],
            "thickness": sheet.thickness, "support": supports,
        },
        "material": {"young": sheet.young, "poisson": 0.3, "density": 1400.0},
        "drive": [
            {"edge": "bottom", "direction": [0.0, -1.0, 0.0], "speed": "1 mm/s", "travel": travel, "guide": False,
             "run_up": 0.0}
        ],
        "solve": {"method": "static", "rtol": 1e-3, "error_estimates": "off"},
        "save": {"every": travel / 73.0},
    }  # fmt: skip
    if sheet.contact:
        case["contact"] = {"law": "linear", "stiffness": "1e4 N/m"}
    return case


def curve(sheet: Sheet, folder: Path) -> dict[str, Any]:
    """Extension (m) and force (N) of the whole sheet at the steps of the solver, and numbers of the run.

    The results are in `folder`; a run that is complete there is not repeated, and an interrupted run is continued.
    """
    done = folder / "curve.json"
    model = asdict(sheet)
    if done.is_file():
        found: dict[str, Any] = json.loads(done.read_text(encoding="utf-8"))
        if found["model"] == model:
            return found
    result = fsm.load(sheet_case(sheet)).run(folder, resume=(folder / "checkpoint.h5").is_file(), figures=False)
    travel, force = (np.asarray(values) for values in result.force())
    summary = result.summary
    found = {
        "model": model, "extension": (sheet.parts * travel).tolist(), "force": (sheet.sides * force).tolist(),
        "steps": summary["steps"], "iterations": summary["newton_iterations"], "unknowns": summary["dof"],
        "seconds": summary["wall_time_s"], "events": len(summary.get("events", [])),
        "unstable": summary.get("unstable_equilibria"),
    }  # fmt: skip
    done.write_text(json.dumps(found), encoding="utf-8")
    return found
