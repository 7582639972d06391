"""Small cases that together use all kernels; they serve to compile the kernels in advance."""

from __future__ import annotations

from typing import Any, NamedTuple

from fsm.scene.case import Case

__all__ = [
    "WarmUp", "warm_up_lattice", "warm_up_membrane", "warm_up_plates", "warm_up_scissor", "warm_up_springs",
    "warm_up_strip",
]  # fmt: skip


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
    """Small film with a patch, cables and an impact; `film` is described in `fsm.scene.membrane.Tension`."""
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
