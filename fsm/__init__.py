"""Deployment of folded strips and creased sheets by finite-segment multibody dynamics.

From a file::

    import fsm

    loaded = fsm.load_case("case.toml", ["strip.fold_angle=75 deg"])
    summary = fsm.run_case(loaded, "out/run")
    solution = fsm.read_solution("out/run/result.h5")

A public name is imported at its first use, so that ``import fsm`` is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fsm.errors import CaseError, EnergyAbort, ExpectationFailed, Fault, FsmError, NotConverged
    from fsm.results.solution import Solution
    from fsm.results.store import read_solution
    from fsm.run import run_case
    from fsm.scene.case import Case, Expect, Save, Solve, Strip
    from fsm.scene.contact import Contact, Friction
    from fsm.scene.load_case import LoadedCase, load_case
    from fsm.scene.loads import Constant, Drive, Load, Ramp, Table
    from fsm.scene.materials import FamilyCrease, LinearCrease, Material, SplineCrease
    from fsm.scene.scene import Body, ContactPair, ForceElement, Plate, PlateGroup, Scene, Surface
    from fsm.scene.table import TableCase, load_table
    from fsm.segments.compile import compile_scene
    from fsm.solve.simulate import simulate
    from fsm.table import run_table

_MODULES: dict[str, str] = {
    **dict.fromkeys(
        ("CaseError", "EnergyAbort", "ExpectationFailed", "Fault", "FsmError", "NotConverged"), "fsm.errors"
    ),
    "Solution": "fsm.results.solution",
    "read_solution": "fsm.results.store",
    "run_case": "fsm.run",
    **dict.fromkeys(("Case", "Expect", "Save", "Solve", "Strip"), "fsm.scene.case"),
    **dict.fromkeys(("Contact", "Friction"), "fsm.scene.contact"),
    **dict.fromkeys(("LoadedCase", "load_case"), "fsm.scene.load_case"),
    **dict.fromkeys(("Constant", "Drive", "Load", "Ramp", "Table"), "fsm.scene.loads"),
    **dict.fromkeys(("FamilyCrease", "LinearCrease", "Material", "SplineCrease"), "fsm.scene.materials"),
    **dict.fromkeys(("Body", "ContactPair", "ForceElement", "PlateGroup", "Plate", "Scene", "Surface"), "fsm.scene.scene"),
    **dict.fromkeys(("TableCase", "load_table"), "fsm.scene.table"),
    "compile_scene": "fsm.segments.compile",
    "simulate": "fsm.solve.simulate",
    "run_table": "fsm.table",
}
"""Module that defines each public name."""

__all__ = [
    "Body",
    "Case",
    "CaseError",
    "Constant",
    "Contact",
    "ContactPair",
    "Drive",
    "EnergyAbort",
    "Expect",
    "ExpectationFailed",
    "FamilyCrease",
    "Fault",
    "ForceElement",
    "Friction",
    "FsmError",
    "PlateGroup",
    "LinearCrease",
    "Load",
    "LoadedCase",
    "Material",
    "NotConverged",
    "Plate",
    "Ramp",
    "Save",
    "Scene",
    "Solution",
    "Solve",
    "SplineCrease",
    "Strip",
    "Surface",
    "Table",
    "TableCase",
    "__version__",
    "compile_scene",
    "load_case",
    "load_table",
    "read_solution",
    "run_case",
    "run_table",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        value: Any = import_module("fsm.version").fsm_version()
    elif name in _MODULES:
        value = getattr(import_module(_MODULES[name]), name)
    else:
        raise AttributeError(f"module 'fsm' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
