"""The case: what a case file says, section by section, with every key a user may write."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from fsm.scene.contact import Contact, Friction, with_stiffness
from fsm.scene.lattice import Lattice
from fsm.scene.loads import Drive, Load
from fsm.scene.materials import Crease, Material
from fsm.scene.membrane import (
    Air,
    Cable,
    Damping,
    Deployed,
    Impact,
    Membrane,
    Patch,
    Support,
    Tension,
    Vibration,
)
from fsm.scene.model import Model
from fsm.scene.obstacle import Obstacle
from fsm.scene.scene import Scene
from fsm.scene.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor, Stop
from fsm.scene.units import Acceleration, Angle, Count, Length, Number, Time

__all__ = [
    "Analysis", "Case", "Expect", "Release", "Save", "Solve", "Start", "Strip", "contact_of_strip", "contact_scale",
]  # fmt: skip


MOST_SEGMENTS = 50_000


class Strip(Model):
    """A zig-zag folded strip: panels 1, 3, 5 rise, 2, 4, 6 fall; crease i joins panels i and i + 1.

    Attributes
    ----------
    length, width, thickness : m
    panels : int
    fold_angle : rad
        Angle of every panel with the horizontal.
    segments_per_panel : int
        Segments of a panel that can bend; a held panel is one rigid plate.
    grading : -
        1 for equal segments; g > 1 makes the middle segment of a panel g times shorter than its end segments.
    half_cell : bool
        Put the bending flexibility of the half segments next to a crease in series with it: second-order
        accurate.
    held : panels that do not move; absent means the first and the last
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

    @model_validator(mode="after")
    def _sized(self) -> Self:
        if self.panels * self.segments_per_panel > MOST_SEGMENTS:
            count = self.panels * self.segments_per_panel
            raise ValueError(f"panels x segments_per_panel = {count:,} segments; {MOST_SEGMENTS:,} at most")
        return self


def contact_scale(strip: Strip, material: Material) -> tuple[float, float]:
    """Force (N) and depth (m) of a whole face by which the contact of a strip is as good as rigid.

    A panel buckles between its creases at about 40 EI/a^2, which a hundredth of its face may have to carry. The peak of the
    trial strip is then lower by about ten times the depth over the panel's length: 0.02 %.
    """
    panel = strip.length / strip.panels
    force = 4000.0 * material.bending(strip.width, strip.thickness) / (panel * panel)
    return force, min(2e-5 * panel, 0.01 * strip.thickness)


def contact_of_strip(written: Any, strip: Strip | None, material: Material | None) -> Any:
    """The contact section of a strip: with a stiffness from the strip's material if it has none of its own."""
    if not isinstance(written, Mapping):
        return written
    if strip is None or material is None:
        return with_stiffness(written, 1.0, 1.0)  # one of them is faulty or missing, which is said where it stands
    return with_stiffness(written, *contact_scale(strip, material))


Start = Literal["as-folded", "equilibrium"]


class Release(Model):
    """A hold before a motion that nothing drives.

    Attributes
    ----------
    hold_time : s
        Everything is held as it starts until this time and is released then, at rest.
    """

    hold_time: Annotated[Time, Field(gt=0)]


Method = Literal["auto", "static", "generalized-alpha", "newmark", "Radau-blocks", "Radau", "BDF", "LSODA"]


class Solve(Model):
    """How to integrate.

    Attributes
    ----------
    method : str
        "auto"; "static" (equilibria as the drives move, the dynamics at snaps); "generalized-alpha"; "newmark";
        "Radau-blocks" (Radau's steps, linear algebra of its own) and "Radau", "BDF", "LSODA" of SciPy.
    rtol : -
        Relative tolerance; absolute tolerances follow from it and the sizes of the scene. Of statics, the increments
        follow from it: a prediction may be off by its root, of the structure's size or in radians.
    increment : m
        First increment of the drive's travel; statics only. A 200th of the travel if absent.
    imperfection : -
        Side of a bifurcation that statics goes to: positive, along the critical mode with its largest component positive;
        negative, against it; 0, to the side of lower energy.
    rho_inf : -
        Spectral radius at infinity, generalized-alpha only: factor on stiff vibrations in a step. 0.6 if absent.
    step : s
        Fixed step, generalized-alpha and Newmark only; without it the error is controlled.
    end_time : s
        Needed only without a drive.
    max_step : s
    max_steps : int
        The solve is given up (exit code 3) after so many steps.
    spatial : bool
        Six degrees of freedom a body even if everything lies in one plane.
    energy_abort : -
        Stop (exit code 5) when the energy balance is off by more than this part of the energy turned over.
    """

    method: Method = "auto"
    rtol: Annotated[Number, Field(ge=1e-12, le=1e-2)] = 1e-6
    end_time: Annotated[Time, Field(gt=0)] | None = None
    max_step: Annotated[Time, Field(gt=0)] | None = None
    max_steps: Annotated[Count, Field(ge=1)] = 200_000
    spatial: bool = False
    energy_abort: Annotated[Number, Field(gt=0)] = 0.05
    increment: Annotated[Length, Field(gt=0)] | None = None
    imperfection: Annotated[Number, Field(ge=-1, le=1)] = 0.0
    rho_inf: Annotated[Number, Field(ge=0, le=1)] | None = None
    step: Annotated[Time, Field(gt=0)] | None = None


class Save(Model):
    """What is kept: a record `every` so much travel of the first drive, or every `interval` of time.

    200 records if neither is given.
    """

    every: Annotated[Length, Field(gt=0)] | None = None
    interval: Annotated[Time, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.every is not None and self.interval is not None:
            raise ValueError("give `every` (travel) or `interval` (time), not both")
        return self


class Expect(Model):
    """A number of the summary and how far off it may be; missed, the run ends with exit code 4."""

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
    """A whole case: what there is, what acts on it, how to solve it, what to keep.

    What there is: a strip or a lattice (or a scene written out) to deploy, a membrane to vibrate, or a scissor array. With
    `stages`, one analysis after the other: the strip as it is deployed is the film that vibrates. `start` says what a
    deployment starts from; if it is absent, `fsm.scene.start` chooses.
    """

    title: Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x1f\x7f]*$")] = ""
    units: Literal["SI", "mm-N-s"] = "SI"
    analysis: Analysis = "deploy"
    stages: tuple[Literal["deploy"], Literal["vibrate"]] | None = None
    start: Start | None = None
    release: Release | None = None
    strip: Strip | None = None
    lattice: Lattice | None = None
    scene: Scene | None = None
    membrane: Membrane | None = None
    material: Material | None = None
    crease: Crease | None = None
    contact: Contact | None = None
    friction: Friction | None = None
    drive: tuple[Drive, ...] = ()
    load: tuple[Load, ...] = ()
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
        """The analyses, in order."""
        return self.stages or (self.analysis,)

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
        if sum(part is not None for part in (self.strip, self.lattice, self.scene)) != 1:
            raise ValueError("give one of [strip], [lattice] and [scene]")
        if self.strip is not None and (self.material is None or self.crease is None):
            raise ValueError("[strip] needs [material] and [crease]")
        return self
