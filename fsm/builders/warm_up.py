"""Small cases that together use all kernels; they serve to compile the kernels in advance."""

from __future__ import annotations

from typing import Any, NamedTuple

from fsm.case.models.case import Case

_TOUCH = (
    "contact.law=linear", "contact.stiffness=1e4", "friction.mu_static=0.3", "friction.mu_dynamic=0.2",
    "friction.v_static=0.01", "friction.v_dynamic=0.02",
)  # fmt: skip
_SMALL = ("sheet.columns=2", "sheet.rows=2", "save.every=none", "save.interval=1")
_PUSH = ("drive.0.travel=0.2 mm",)
_BRIEF = ("drive=none", "solve.method=auto", "solve.end_time=1e-6")
_LOAD = ("drive=none", 'load.0.at="edge right"', "load.0.force=[-1e-3, 0, 0]", "solve.end_time=1e-3", "save.interval=1")
_FACETS: dict[str, tuple[str, ...]] = {
    "rigid": ("sheet",),
    "bend-lines": ("sheet", "sheet.facets=bend-lines", "sheet.bend_stiffness_per_length=0.5"),
    "bars": ("sheet", "sheet.facets=bars"),
    "flexible": ("flexible", "sheet.mesh_size=20 mm"),
}
_UNBOUNDED = (
    "load.0.time.kind=ramp", "load.0.time.end=1", "load.0.time.shape=unbounded",
    "solve.method=arc-length", "solve.end_time=1",
)  # fmt: skip
_MESH = ("sheet.mesh_size=50 mm", "sheet.bend_stiffness_per_length=none")
_GAS = ("gas.0.supply_mass=1e-6", "save.interval=1")

WHOLE: dict[str, tuple[tuple[str, ...], ...]] = {
    **{
        f"{facets} facets, {kind}": ((*case, *_SMALL, *short), (*case, *_SMALL, *short, *_TOUCH), (*case, *_SMALL, *_LOAD))
        for facets, case in _FACETS.items()
        for kind, short in (("static", _PUSH), ("in time", _BRIEF))
    },
    "shells": (("boom", "sheet.mesh=[4, 4]", "drive.0.turn=0.01"), ("plate", "sheet.mesh=[2, 2]", "solve.end_time=0.01")),
    "gas": (
        ("gas", "solve.end_time=0.05", *_GAS),
        ("gas", *_BRIEF[1:], *_GAS),
        ("gas", "sheet.facets=bend-lines", "solve.end_time=0.05", *_GAS),
        ("gas", "sheet.facets=flexible", *_MESH, "solve.end_time=0.05", *_GAS),
    ),
    "arc length": (
        ("kresling", "load.0.force=[0, 0, -1]"),
        ("truss", "load.0.force=[0, 0, -1]"),
        (*_FACETS["flexible"], *_SMALL, *_LOAD, *_UNBOUNDED),
    ),
    "films, cables, beams, trusses": (
        ("beam", "step.0.duration=0.01", "save.interval=1"),
        ("cable", "solve.end_time=1e-3"),
        ("cable", "solve.end_time=1e-3", "solve.method=generalized-alpha"),
        ("truss", "solve.method=static", "solve.end_time=1e-2"),
    ),
    "mechanism": (("mechanism", "solve.end_time=1e-3"), ("wing", "solve.end_time=1e-3")),
}
"""Shortened cases of `fsm init` (template, overrides) for the kernels of sheets, gas, and scenes with nodes."""


class WarmUp(NamedTuple):
    """Case with bodies that come into contact after a shift.

    Attributes
    ----------
    case : Case
    moved : prefix of the names of the bodies
    shift : displacement in x and z, m
    """

    case: Case
    moved: str
    shift: tuple[float, float]


def warm_up_strip(spatial: bool, hysteresis: bool = False) -> WarmUp:
    """Strip with tabulated creases, contact (also at the ends of panels), and friction."""
    strip: dict[str, Any] = {
        "strip": {
            "length": 0.48, "width": 0.04, "thickness": 1e-4, "panels": 6, "fold_angle": 1.4, "segments_per_panel": 2,
        },
        "material": {"young": 3e9, "density": 800.0},
        "crease": {
            "law": "spline", "angle": [0.0, 1.0, 2.0, 3.0], "moment": [0.0, 0.01, 0.015, 0.018], "rest_angle": 3.0,
        }
        | ({"unloading": [-0.001, 0.008, 0.014, 0.018]} if hysteresis else {}),
        "contact": {"stiffness": 1e6, "damping": 1.0},
        "friction": {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 0.01, "v_dynamic": 0.02},
        "drive": [{"crease": 3, "speed": 0.02, "travel": 0.01}],
        "solve": {"spatial": spatial},
    }  # fmt: skip
    return WarmUp(Case.model_validate(strip), "panel 3", (0.024, -0.03))


def warm_up_springs(spatial: bool, curved: bool = False) -> Case:
    """Strip without contact. The creases are linear springs; if `curved`, they have a measured curve."""
    curve = {"law": "spline", "angle": [0.0, 1.5, 3.0], "moment": [0.0, 0.01, 0.015], "rest_angle": 3.0}
    strip: dict[str, Any] = {
        "strip": {
            "length": 0.24, "width": 0.04, "thickness": 1e-4, "panels": 4, "fold_angle": 1.4, "segments_per_panel": 2,
        },
        "material": {"young": 3e9, "density": 800.0},
        "crease": curve if curved else {"law": "linear", "stiffness": 0.01},
        "drive": [{"crease": 2, "speed": 0.02, "travel": 0.01}],
        "solve": {"spatial": spatial},
    }  # fmt: skip
    return Case.model_validate(strip)


def warm_up_plates(spatial: bool) -> WarmUp:
    """Plate that falls on another plate and on an obstacle."""
    plate = {"length": 0.02, "width": 0.02, "thickness": 1e-3}
    body = {"mass": 1e-3, "inertia": [1e-7, 1e-7, 1.5e-7], "plate": plate}
    plates: dict[str, Any] = {
        "scene": {
            "bodies": [
                {"name": "under", "held": True, "position": [0.0, 0.0, 0.0]} | body,
                {"name": "over", "position": [0.005, 0.0, 1.01e-3]} | body,
            ],
            "obstacles": [{"name": "floor", "shape": "plane", "position": [0.0, 0.0, 5e-4]}],
            "pairs": [{"first": "under", "second": "over"}, {"first": "over", "second": "floor"}],
        },
        "contact": {"stiffness": 1e6, "restitution": 0.5},
        "friction": {"law": "lugre", "mu_static": 0.3, "mu_dynamic": 0.2, "v_stribeck": 0.01, "presliding": 1e-5},
        "gravity": [0.0, 0.0, -9.81],
        "solve": {"spatial": spatial, "end_time": 0.01},
    }
    return WarmUp(Case.model_validate(plates), "over", (0.0, -2e-5))


def warm_up_membrane(film: str) -> Case:
    """Small film with a patch, cables and an impact; `film` is described in `fsm.case.models.membrane.Tension`."""
    sheet = {"young": 2e11, "density": 7800.0}
    membrane: dict[str, Any] = {
        "analysis": "vibrate",
        "membrane": {"length": 0.3, "width": 0.3, "thickness": 1e-4, "mesh": [3, 3]},
        "material": {"young": 3e9, "density": 1400.0},
        "patch": [{"place": "centre", "size": 0.1, "thickness": 1e-3} | sheet],
        "cable": [{"place": "edges", "diameter": 1e-3} | sheet],
        "tension": {"strain": 1e-3, "film": film},
        "damping": {"material": 1e-5, "air": 1.0},
        "impact": {"pulse": "half-sine", "force": 0.1, "duration": 1e-3},
        "vibration": {"duration": 2e-3, "modes": 3, "model": "reduced"},
    }
    return Case.model_validate(membrane)


def warm_up_scissor(bars: str) -> Case:
    """One scissor unit with friction in its hinges; `bars` is "rigid", or the type of element."""
    made_of = {"rigid": True} if bars == "rigid" else {"element": bars}
    return Case.model_validate(
        {
            "analysis": "scissor",
            "scissor": {"units": 1, "bar_length": 1.0, "initial_angle": 1.3, "elements_per_bar": 2} | made_of,
            "bar": {"width": 0.02, "height": 0.01},
            "material": {"young": 2e11, "density": 7850.0},
            "hinge": {"friction_moment": 1e-3},
            "force": [{"point": "a1", "force": [0.0, -1.0]}],
            "solve": {"end_time": 1.0},
        }
    )


def warm_up_lattice() -> WarmUp:
    """Column of three squares with dampers in the hinges, planar only."""
    lattice: dict[str, Any] = {
        "lattice": {
            "columns": 1, "rows": 3, "spacing": 0.015, "hinge_length": 2e-3, "angle": 0.3, "axial": 1e5, "shear": 1e3,
            "rotational": 1e-3, "depth": 0.01, "density": 1200.0, "damping": 1e-3,
        },
        "drive": [{"edge": "top", "speed": 1e-3, "travel": 1e-3}],
    }  # fmt: skip
    return WarmUp(Case.model_validate(lattice), "none of them", (0.0, 0.0))
