"""Model of a case file: its sections and their keys."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from fsm.scene.contact import Contact, Friction, with_stiffness
from fsm.scene.gas import Gas, Orifice
from fsm.scene.lattice import Lattice
from fsm.scene.loads import Drive, Load
from fsm.scene.materials import Crease, Material
from fsm.scene.membrane import Air, Cable, Damping, Deployed, Impact, Membrane, Patch, Support, Tension, Vibration
from fsm.scene.model import Model
from fsm.scene.obstacle import Obstacle
from fsm.scene.scene import Scene
from fsm.scene.schema import Place
from fsm.scene.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor, Stop
from fsm.scene.sheet import Sheet
from fsm.scene.solve import Save, Solve
from fsm.scene.steps import Step
from fsm.scene.units import Acceleration, Angle, Count, Length, Number, Time

__all__ = [
    "Analysis", "Case", "Expect", "Release", "Save", "Solve", "Start", "Strip", "contact_of_strip", "contact_scale",
    "held_panels", "root",
]  # fmt: skip


MOST_SEGMENTS = 50_000
"""Largest number of segments of a strip."""


class Strip(Model):
    """Strip folded in a zig-zag: panels 1, 3, 5 rise, panels 2, 4, 6 fall, and crease i joins panels i and i + 1.

    Attributes
    ----------
    length, width, thickness : m
    panels : int
    fold_angle : rad
        Angle of every panel with the horizontal.
    segments_per_panel : int
        Number of segments of a flexible panel; a held panel is one rigid plate.
    grading : -
        1 for equal segments; g > 1 makes the middle segment of a panel g times shorter than its end segments.
    half_cell : bool
        Whether the bending flexibility of the half segments beside a crease acts in series with the crease; this gives
        second-order accuracy.
    held : numbers of the panels that do not move; absent: the first and the last
    """

    length: Annotated[Length, Field(gt=0)]
    width: Annotated[Length, Field(gt=0)]
    thickness: Annotated[Length, Field(gt=0)]
    panels: Annotated[Count, Field(ge=2, le=1000)]
    fold_angle: Annotated[Angle, Field(gt=0, lt=1.5707963267948966)]
    segments_per_panel: Annotated[Count, Field(ge=1, le=5000)] = 40
    grading: Annotated[Number, Field(ge=0.1, le=10)] = 1.0
    half_cell: bool = True
    held: tuple[Count, ...] | None = None

    @property
    def crease_angle(self) -> float:
        """Angle of the folded creases from the flat sheet, rad."""
        return 2.0 * self.fold_angle

    def crease_point(self, number: int) -> tuple[float, float]:
        """Position (x, z) of a crease in the folded strip, m; the numbers 0 and `panels` are the ends of the strip."""
        panel = self.length / self.panels
        return number * panel * math.cos(self.fold_angle), (number % 2) * panel * math.sin(self.fold_angle)

    @model_validator(mode="after")
    def _sized(self) -> Self:
        if self.panels * self.segments_per_panel > MOST_SEGMENTS:
            count = self.panels * self.segments_per_panel
            raise ValueError(
                f"panels x segments_per_panel = {count:,} segments; at most {MOST_SEGMENTS:,} are allowed"
            )
        return self


def held_panels(strip: Strip, drives: Iterable[Drive]) -> frozenset[int]:
    """Numbers of the held panels: by default the first and the last, unless a drive grips this panel or its end."""
    if strip.held is not None:
        return frozenset(strip.held)
    return frozenset({1, strip.panels} - {drive.gripped(strip.panels) for drive in drives})


def contact_scale(strip: Strip, material: Material) -> tuple[float, float]:
    """Force (N) on a whole face and penetration (m) that define a practically rigid contact of a strip.

    A panel of length a buckles between its creases at about 40 EI/a^2, and one hundredth of its face may carry this force.
    The force is therefore 4000 EI/a^2. The peak of the trial strip decreases by ten times depth/a, which is 0.02 %.
    """
    panel = strip.length / strip.panels
    force = 4000.0 * material.bending(strip.width, strip.thickness) / (panel * panel)
    return force, min(2e-5 * panel, 0.01 * strip.thickness)


def contact_of_strip(written: Any, strip: Strip | None, material: Material | None) -> Any:
    """Contact section of a strip; if it gives no stiffness, the stiffness follows from the material of the strip."""
    if not isinstance(written, Mapping):
        return written
    if strip is None or material is None:
        return with_stiffness(written, 1.0, 1.0)  # one of the sections is faulty or missing; another message reports this
    return with_stiffness(written, *contact_scale(strip, material))


Start = Literal["as-folded", "equilibrium"]


class Release(Model):
    """Phase in which bodies are held before a motion without a drive.

    Attributes
    ----------
    hold_time : s
        All bodies are held in their initial position until this time, and then released from rest.
    """

    hold_time: Annotated[Time, Field(gt=0)]


class Expect(Model):
    """Expected value of a number of the summary, with its tolerance; the run ends with exit code 4 if the number is outside
    the tolerance.
    """

    value: float
    rtol: Annotated[float, Field(ge=0)] | None = None
    atol: Annotated[float, Field(ge=0)] | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.rtol is None and self.atol is None:
            raise ValueError("give `rtol` or `atol`")
        return self


Analysis = Literal["deploy", "vibrate", "scissor"]


class Case(Model):
    """Complete case: model, loads, solver settings and records.

    The model is a strip, a lattice, a sheet or a scene for a deployment, a membrane for a vibration, or a scissor array.
    With `stages` two analyses follow each other: the deployed strip is the film of the vibration. `start` is the initial
    state of a deployment; if it is absent, `fsm.scene.start` chooses it. Without `step`, the steps of a deployment follow
    from the other keys (`fsm.segments.plan`).
    """

    extensions: tuple[str, ...] = ()
    title: Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x1f\x7f]*$")] = ""
    units: Literal["SI", "mm-N-s"] = "SI"
    analysis: Analysis = "deploy"
    stages: tuple[Literal["deploy"], Literal["vibrate"]] | None = None
    start: Start | None = None
    release: Release | None = None
    strip: Strip | None = None
    lattice: Lattice | None = None
    sheet: Sheet | None = None
    scene: Scene | None = None
    membrane: Membrane | None = None
    material: Material | None = None
    crease: Crease | None = None
    contact: Contact | None = None
    friction: Friction | None = None
    drive: tuple[Drive, ...] = ()
    load: tuple[Load, ...] = ()
    gas: tuple[Gas, ...] = ()
    orifice: tuple[Orifice, ...] = ()
    step: tuple[Step, ...] = ()
    obstacle: tuple[Obstacle, ...] = ()
    patch: tuple[Patch, ...] = ()
    cable: tuple[Cable, ...] = ()
    support: tuple[Support, ...] = ()
    tension: Tension | None = None
    deployed: Deployed | None = None
    air: Air | None = None
    damping: Damping | None = None
    impact: Impact | None = None
    vibration: Vibration | None = None
    scissor: Scissor | None = None
    bar: BarSection | None = None
    hinge: HingeJoint | None = None
    stop: Stop | None = None
    hold: tuple[PointSupport, ...] = ()
    force: tuple[PointForce, ...] = ()
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, 0.0, 0.0)
    solve: Solve = Solve()
    save: Save = Save()
    expect: dict[str, Expect] = Field(default_factory=dict)

    @field_validator("contact", mode="before")
    @classmethod
    def _stiff_enough(cls, value: Any, info: ValidationInfo) -> Any:
        if "strip" in info.data and info.data["strip"] is None:
            return value
        return contact_of_strip(value, info.data.get("strip"), info.data.get("material"))

    @property
    def steps(self) -> tuple[Analysis, ...]:
        """Analyses of the case, in order."""
        return self.stages or (self.analysis,)

    @property
    def held_panels(self) -> frozenset[int]:
        """Numbers of the held panels of the strip."""
        drives = [*self.drive, *(drive for step in self.step for drive in step.drive)]
        return frozenset() if self.strip is None else held_panels(self.strip, drives)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.steps[0] == "vibrate":
            if self.membrane is None or self.material is None or self.tension is None:
                raise ValueError('analysis = "vibrate" needs [membrane], [material] and [tension]')
            return self
        if self.steps[0] == "scissor":
            if self.scissor is None or self.material is None or self.bar is None:
                raise ValueError('analysis = "scissor" needs [scissor], [bar] and [material]')
            return self
        given = [part is not None for part in (self.strip, self.lattice, self.sheet, self.scene)]
        if sum(given) != 1 and given not in ([True, False, False, True], [False, False, True, True]):
            text = "give [strip], [lattice], [sheet] or [scene]; beside a [strip] or a [sheet], a [scene] adds its parts"
            raise ValueError(text)
        for name, part in (("strip", self.strip), ("sheet", self.sheet)):
            shell = self.sheet is not None and self.sheet.is_shell
            if part is not None and (self.material is None or (self.crease is None and not shell)):
                raise ValueError(f"[{name}] needs [material]" + ("" if shell else " and [crease]"))
        return self


def root(data: Mapping[str, Any]) -> Place:
    """Place (path and type) of a whole case."""
    return Place(Case, data, {})
