"""The sections of a case as the checks between them see them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from fsm.errors import Fault
from fsm.scene.case import Analysis, Release, Save, Solve, Strip
from fsm.scene.contact import Contact, Friction
from fsm.scene.lattice import Lattice
from fsm.scene.loads import Drive
from fsm.scene.materials import Crease, Material
from fsm.scene.membrane import Cable, Impact, Membrane, Patch, Support, Tension, Vibration
from fsm.scene.scene import Scene
from fsm.scene.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor, Stop

__all__ = ["Sections", "keys_of_paths", "method_faults", "path_faults"]


@dataclass(frozen=True)
class Sections:
    """The sections of a case that are valid by themselves, and which ones were written at all.

    A section that was written but is not here is faulty, and is not judged again.

    Attributes
    ----------
    written : names of the sections in the file
    stages : the analyses; none if they cannot be read
    analysis : what the key says
    drives, patches, cables, supports, holds, forces : number of the item in the file, from 0, and the item
    """

    written: frozenset[str] = frozenset()
    stages: tuple[Analysis, ...] = ("deploy",)
    analysis: Analysis | None = "deploy"
    membrane: Membrane | None = None
    tension: Tension | None = None
    impact: Impact | None = None
    vibration: Vibration | None = None
    scissor: Scissor | None = None
    bar: BarSection | None = None
    hinge: HingeJoint | None = None
    stop: Stop | None = None
    release: Release | None = None
    strip: Strip | None = None
    lattice: Lattice | None = None
    scene: Scene | None = None
    material: Material | None = None
    crease: Crease | None = None
    contact: Contact | None = None
    gravity: tuple[float, ...] = ()
    friction: Friction | None = None
    solve: Solve | None = None
    save: Save | None = None
    drives: Mapping[int, Drive] = field(default_factory=dict)
    patches: Mapping[int, Patch] = field(default_factory=dict)
    cables: Mapping[int, Cable] = field(default_factory=dict)
    supports: Mapping[int, Support] = field(default_factory=dict)
    holds: Mapping[int, PointSupport] = field(default_factory=dict)
    forces: Mapping[int, PointForce] = field(default_factory=dict)


def method_faults(solve: Solve | None) -> Iterable[Fault]:
    """Keys that only one method has."""
    if solve is None or solve.method == "generalized-alpha":
        return
    only = 'only method = "generalized-alpha" has it'
    if solve.rho_inf is not None:
        yield Fault("solve.rho_inf", f'{only}, not "{solve.method}"; take it out')
    if solve.step is not None and solve.method != "newmark":
        yield Fault("solve.step", f'{only} (and "newmark"), not "{solve.method}"; take it out')


def path_faults(solve: Solve | None) -> Iterable[Fault]:
    """Keys that only the following of equilibria has; "auto" may come to that."""
    if solve is None or solve.method in ("auto", "static"):
        return
    for key in keys_of_paths(solve):
        yield Fault(f"solve.{key}", f'only method = "static" has it (and "auto"), not "{solve.method}"; take it out')


def keys_of_paths(solve: Solve) -> list[str]:
    """Keys that say something and are of the following of equilibria as drives move; resolved cases say every default."""
    return [key for key in ("increment", "imperfection") if getattr(solve, key)]
