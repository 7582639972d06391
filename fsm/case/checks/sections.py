"""Sections of a case, for checks that involve several of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from fsm.case.models.case import Analysis, Release, Strip
from fsm.case.models.contact import Contact, Friction
from fsm.case.models.lattice import Lattice
from fsm.case.models.loads import Drive, Load
from fsm.case.models.materials import Crease, Material
from fsm.case.models.membrane import Cable, Impact, Membrane, Patch, Support, Tension, Vibration
from fsm.case.models.scene import Scene
from fsm.case.models.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor, Stop
from fsm.case.models.sheet import Sheet
from fsm.case.models.solve import Save, Solve
from fsm.case.models.steps import Step
from fsm.errors import Fault


@dataclass(frozen=True)
class Sections:
    """Sections of a case that are valid by themselves, and the names of all sections in the file.

    A section that is named in `written` and absent here has other faults, and needs no further checks.

    Attributes
    ----------
    written : names of the sections in the file
    stages : analyses of the case; empty if they cannot be read
    analysis : value of the key `analysis`
    faulty_steps : whether the file has faulty steps, which `steps` does not contain
    drives, loads, steps, patches, cables, supports, holds, forces : items by their number in the file, from 0
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
    sheet: Sheet | None = None
    scene: Scene | None = None
    material: Material | None = None
    crease: Crease | None = None
    contact: Contact | None = None
    gravity: tuple[float, ...] = ()
    friction: Friction | None = None
    solve: Solve | None = None
    save: Save | None = None
    drives: Mapping[int, Drive] = field(default_factory=dict)
    loads: Mapping[int, Load] = field(default_factory=dict)
    steps: Mapping[int, Step] = field(default_factory=dict)
    faulty_steps: bool = False
    patches: Mapping[int, Patch] = field(default_factory=dict)
    cables: Mapping[int, Cable] = field(default_factory=dict)
    supports: Mapping[int, Support] = field(default_factory=dict)
    holds: Mapping[int, PointSupport] = field(default_factory=dict)
    forces: Mapping[int, PointForce] = field(default_factory=dict)


    @property
    def all_drives(self) -> list[tuple[str, Drive]]:
        """Drives of the case and of its steps, with their paths."""
        found = [(f"drive.{index}", drive) for index, drive in self.drives.items()]
        for number, step in self.steps.items():
            found += [(f"step.{number}.drive.{index}", drive) for index, drive in enumerate(step.drive)]
        return found


def missing_sections(sections: Sections, needed: Mapping[str, str]) -> Iterable[Fault]:
    """Faults of missing sections; `needed` gives the reason for each."""
    for name, why in needed.items():
        if name not in sections.written:
            yield Fault(name, f"section [{name}] is missing; {why}")


def method_faults(solve: Solve | None) -> Iterable[Fault]:
    """Faults of keys that the chosen method does not use."""
    if solve is None or (solve.method == "generalized-alpha" and solve.branch is None):
        return
    if solve.method != "generalized-alpha" and solve.rho_inf is not None:
        yield Fault("solve.rho_inf", f'applies to method = "generalized-alpha", not to "{solve.method}"; remove this key')
    if solve.branch is not None and solve.method != "arc-length":
        text = f'is used by method = "arc-length" only, not by "{solve.method}"; remove this key'
        yield Fault("solve.branch", text)
    if solve.step is not None and solve.method not in ("newmark", "mean-force"):
        used = 'is used by method = "generalized-alpha", "mean-force" and "newmark" only'
        yield Fault("solve.step", f'{used}, not by "{solve.method}"; remove this key')


def static_faults(solve: Solve | None) -> Iterable[Fault]:
    """Faults of keys of statics with another method; "auto" may select statics."""
    if solve is None or solve.method in ("static", "auto"):
        return
    for key in static_keys(solve):
        text = f'is used by method = "static" and "auto" only, not by "{solve.method}"; remove this key'
        yield Fault(f"solve.{key}", text)


def static_keys(solve: Solve) -> list[str]:
    """Keys of statics with a value other than the default; complete case files also contain the defaults."""
    return [key for key in ("increment", "imperfection", "force_limit") if getattr(solve, key)]
