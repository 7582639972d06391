"""Deployment of folded strips and creased sheets by finite-segment multibody dynamics.

From a file::

    import fsm

    case = fsm.load("case.toml").set("strip.fold_angle", "75 deg")
    result = case.run("out/run")
    travel, force = result.force()

or built in Python with `Model`; see docs/python.md. A public name is imported at its first use, so that ``import fsm`` is
fast.
"""

from __future__ import annotations

from importlib import import_module as _import_module

TYPE_CHECKING = False  # the import of the module typing takes longer than the import of the rest of this module
if TYPE_CHECKING:
    from fsm.api.calibration import Calibrated, calibrate
    from fsm.api.case import Case, CaseCheck, Result, load
    from fsm.api.case import open_result as open
    from fsm.api.model import Model
    from fsm.api.picture import Picture
    from fsm.api.result import Curve, Series
    from fsm.case.loading.load_case import LoadedCase, load_case
    from fsm.case.loading.table import TableCase, load_table
    from fsm.case.models.case import Expect, Release, Strip
    from fsm.case.models.contact import Contact, Friction
    from fsm.case.models.flexible import SceneBeam, SceneCable, SceneFilm, SceneFrame, SceneSeam
    from fsm.case.models.lattice import Lattice
    from fsm.case.models.loads import Drive, Load
    from fsm.case.models.materials import FamilyCrease, LinearCrease, Material, SplineCrease
    from fsm.case.models.membrane import Membrane, Tension, Vibration
    from fsm.case.models.obstacle import Obstacle
    from fsm.case.models.scene import Body, ContactPair, ForceElement, Plate, PlateGroup, Scene, Surface
    from fsm.case.models.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor, Stop
    from fsm.case.models.sheet import Sheet
    from fsm.case.models.sheet_parts import BarsOfSheet, SheetCrease, SheetPly, SheetProbe, SheetSupport
    from fsm.case.models.solve import Save, Solve, Step
    from fsm.case.models.time_program import Constant, Cycle, Ramp, Table
    from fsm.case.models.truss import SceneTruss
    from fsm.errors import CannotWrite, CaseError, EnergyAbort, ExpectationFailed, Fault, FsmError, NotConverged, NotInResult
    from fsm.model.compile.compile import compile_scene
    from fsm.results.channel import Channel, ChannelInfo, Dim
    from fsm.results.solution import Layout, Record, Solution
    from fsm.results.store import read_solution
    from fsm.run.run_case import run_case
    from fsm.run.table import run_table
    from fsm.solve.simulate import simulate

    __version__: str

_MODULES = {
    "fsm.api.calibration": ("Calibrated",),
    "fsm.api.case": ("Case", "CaseCheck", "Result", "load", "open"),
    "fsm.api.model": ("Model",),
    "fsm.api.picture": ("Picture",),
    "fsm.api.result": ("Curve", "Series"),
    "fsm.errors": (
        "CannotWrite", "CaseError", "EnergyAbort", "ExpectationFailed", "Fault", "FsmError", "NotConverged", "NotInResult",
    ),
    "fsm.results.channel": ("Channel", "ChannelInfo", "Dim"),
    "fsm.results.solution": ("Layout", "Record", "Solution"),
    "fsm.results.store": ("read_solution",),
    "fsm.run.run_case": ("run_case",),
    "fsm.case.models.case": ("Expect", "Release", "Strip"),
    "fsm.case.models.contact": ("Contact", "Friction"),
    "fsm.case.models.flexible": ("SceneBeam", "SceneCable", "SceneFilm", "SceneFrame", "SceneSeam"),
    "fsm.case.models.lattice": ("Lattice",),
    "fsm.case.loading.load_case": ("LoadedCase", "load_case"),
    "fsm.case.models.loads": ("Drive", "Load"),
    "fsm.case.models.materials": ("FamilyCrease", "LinearCrease", "Material", "SplineCrease"),
    "fsm.case.models.membrane": ("Membrane", "Tension", "Vibration"),
    "fsm.case.models.obstacle": ("Obstacle",),
    "fsm.case.models.scene": ("Body", "ContactPair", "ForceElement", "Plate", "PlateGroup", "Scene", "Surface"),
    "fsm.case.models.scissor": ("BarSection", "HingeJoint", "PointForce", "PointSupport", "Scissor", "Stop"),
    "fsm.case.models.sheet": ("Sheet",),
    "fsm.case.models.sheet_parts": ("BarsOfSheet", "SheetCrease", "SheetPly", "SheetProbe", "SheetSupport"),
    "fsm.case.models.solve": ("Save", "Solve", "Step"),
    "fsm.case.loading.table": ("TableCase", "load_table"),
    "fsm.case.models.time_program": ("Constant", "Cycle", "Ramp", "Table"),
    "fsm.case.models.truss": ("SceneTruss",),
    "fsm.model.compile.compile": ("compile_scene",),
    "fsm.solve.simulate": ("simulate",),
    "fsm.run.table": ("run_table",),
}
"""Public names by the module that defines them."""
_HOME = {name: module for module, names in _MODULES.items() for name in names}
_RENAMED = {"open": "open_result"}

__all__ = [
    "BarSection", "BarsOfSheet", "Body", "Calibrated", "CannotWrite", "Case", "CaseCheck", "CaseError", "Channel",
    "ChannelInfo", "Constant", "Contact", "ContactPair", "Curve", "Cycle", "Dim", "Drive", "EnergyAbort", "Expect",
    "ExpectationFailed", "FamilyCrease", "Fault", "ForceElement", "Friction", "FsmError", "HingeJoint", "Lattice",
    "Layout", "LinearCrease", "Load", "LoadedCase", "Material", "Membrane", "Model", "NotConverged", "NotInResult",
    "Obstacle", "Picture", "Plate", "PlateGroup", "PointForce", "PointSupport", "Ramp", "Record", "Release", "Result",
    "Save", "Scene", "SceneBeam", "SceneCable", "SceneFilm", "SceneFrame", "SceneSeam", "SceneTruss", "Scissor",
    "Series", "Sheet", "SheetCrease", "SheetPly", "SheetProbe", "SheetSupport", "Solution", "Solve", "SplineCrease", "Step",
    "Stop", "Strip", "Surface", "Table", "TableCase", "Tension", "Vibration", "__version__", "calibrate",
    "compile_scene", "load", "load_case", "load_table", "open", "read_solution", "run_case", "run_table", "simulate",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name == "__version__":
        value: object = _import_module("fsm.io.provenance").fsm_version()
    elif name == "calibrate":  # this package can also be called as a function
        value = _import_module("fsm.calibrate")
    elif name in _HOME:
        value = getattr(_import_module(_HOME[name]), _RENAMED.get(name, name))
    else:
        raise AttributeError(f"module 'fsm' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
