"""Model of a case file: its sections and their keys."""

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from fsm.case.models.contact import Contact, Friction, with_stiffness
from fsm.case.models.event import Event
from fsm.case.models.gas import Gas, Orifice
from fsm.case.models.lattice import Lattice
from fsm.case.models.loads import Drive, Load
from fsm.case.models.margin import Margin
from fsm.case.models.materials import Crease, Material
from fsm.case.models.membrane import Air, Cable, Damping, Deployed, Impact, Membrane, Patch, Support, Tension, Vibration
from fsm.case.models.obstacle import Obstacle
from fsm.case.models.scene import Scene
from fsm.case.models.scissor import BarSection, HingeJoint, PointForce, PointSupport, Scissor, Stop
from fsm.case.models.sheet import Sheet
from fsm.case.models.solve import Save, Solve, Step
from fsm.case.models.wing import Wing
from fsm.case.schema.model import Key, Model
from fsm.case.schema.schema import Place
from fsm.case.schema.units import Acceleration, Angle, Count, Length, Number, Time

MOST_SEGMENTS = 50_000
"""Largest number of segments of a strip."""


class Strip(Model):
    """Strip folded in a zig-zag: panels 1, 3, 5 rise, panels 2, 4, 6 fall, and crease i joins panels i and i + 1."""

    length: Length = Key("length of the unfolded strip", gt=0)
    width: Length = Key("size along the creases", gt=0)
    thickness: Length = Key("thickness of the sheet", gt=0)
    panels: Count = Key("number of panels", ge=2, le=1000)
    fold_angle: Angle = Key("angle of every panel with the horizontal", gt=0, lt=1.5707963267948966)
    segments_per_panel: Count = Key(
        "segments of a flexible panel; a held panel is one rigid plate", default=40, ge=1, le=5000
    )
    grading: Number = Key(
        "g > 1: the middle segment of a panel is g times shorter than its end segments", default=1.0, ge=0.1, le=10
    )
    half_cell: bool = Key(
        "half-cell correction: the flexibility of the half segments beside a crease is in series with it", default=True
    )
    held: tuple[Count, ...] | None = Key(
        "panels that do not move", default=None,
        shown="the first and the last, without a panel that a drive grips by `panel` or `end`",
        within="a list of panel numbers"
    )  # fmt: skip

    @property
    def crease_angle(self) -> float:
        """Angle of the folded creases from the flat sheet, rad."""
        return 2.0 * self.fold_angle

    def turn(self, panel: int) -> float:
        """Rotation of a panel (from 0) about +y, rad; the first panel rises, which is a negative rotation."""
        return self.fold_angle * (1 if panel % 2 else -1)

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
    """Phase in which bodies are held before a motion without a drive."""

    hold_time: Time = Key("time of the release", gt=0, within="> 0, < `solve.end_time`")


class Expect(Model):
    """Expected value of a number of the summary, with its tolerance; the run ends with exit code 4 if the number is outside
    the tolerance.
    """

    value: float = Key("expected value, in SI")
    rtol: Annotated[float, Field(ge=0)] | None = Key(
        "tolerance relative to the value; give `rtol`, `atol` or both; both tolerances are added", default=None
    )
    atol: Annotated[float, Field(ge=0)] | None = Key("absolute tolerance, in SI", default=None)

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
    state of a deployment; if it is absent, `fsm.case.plan.step_items` chooses it. Without `step`, the steps of a deployment
    follow from the other keys (`fsm.model.plan.plan`).
    """

    extensions: tuple[str, ...] = Key(
        "Python files that add laws, builders or channels ([extensions](extend/index.md)); they are executed "
        "with the case", default=(),
    )  # fmt: skip
    title: str = Key("shown in progress and plots", default="", max_length=500, pattern=r"^[^\x00-\x1f\x7f]*$")
    units: Literal["SI", "mm-N-s"] = Key("unit system of plain numbers", default="SI")
    analysis: Analysis = Key("kind of analysis", default="deploy")
    stages: tuple[Literal["deploy"], Literal["vibrate"]] | None = Key(
        "instead of `analysis`: both analyses in sequence", default=None, within='["deploy", "vibrate"]'
    )
    start: Start | None = Key(
        "initial state of a deployment, at rest", default=None,
        shown='"equilibrium" for a strip; "as-folded" for other models, and for a strip without a drive whose '
        "creases carry a moment",
    )  # fmt: skip
    release: Release | None = Key("hold before the motion; only without a drive", default=None)
    strip: Strip | None = Key("folded strip; give this, `lattice`, `sheet` or `scene`", default=None)
    lattice: Lattice | None = Key("rotating squares; give this, `strip`, `sheet` or `scene`", default=None)
    sheet: Sheet | None = Key("folded sheet in space; give this, `strip`, `lattice` or `scene`", default=None)
    scene: Scene | None = Key(
        "any graph of bodies and force elements; give this, `strip`, `lattice` or `sheet`", default=None
    )
    wing: Wing | None = Key(
        "wing of hinged panels; its bodies and joints become parts of `scene` when a file is read", default=None
    )
    membrane: Membrane | None = Key('film; required for "vibrate"', default=None)
    material: Material | None = Key(
        "material of the strip, the sheet, the film or the bars; required for these", default=None
    )
    crease: Crease | None = Key("law of all creases of the strip or sheet; required for these", default=None)
    contact: Contact | None = Key("normal contact of faces", default=None)
    friction: Friction | None = Key("friction of faces in contact", default=None)
    drive: tuple[Drive, ...] = Key("prescribed motions, `[[drive]]`", default=())
    margin: tuple[Margin, ...] = Key("motorisation margins of joints, `[[margin]]`", default=())
    load: tuple[Load, ...] = Key("forces and couples, `[[load]]`", default=())
    gas: tuple[Gas, ...] = Key("gas in chambers of a sheet, `[[gas]]`", default=())
    orifice: tuple[Orifice, ...] = Key("flow of gas between chambers, `[[orifice]]`", default=())
    step: tuple[Step, ...] = Key("steps of a deployment, `[[step]]`", default=())
    event: tuple[Event, ...] = Key("what happens when a condition becomes true, `[[event]]`", default=())
    obstacle: tuple[Obstacle, ...] = Key("rigid obstacles for contact, `[[obstacle]]`", default=())
    patch: tuple[Patch, ...] = Key("stiff squares of the film, `[[patch]]`", default=())
    cable: tuple[Cable, ...] = Key("cables of the film, `[[cable]]`", default=())
    support: tuple[Support, ...] = Key("supports of the film, `[[support]]`", default=())
    tension: Tension | None = Key("tension of the film; required for a film", default=None)
    deployed: Deployed | None = Key("film model of a deployed strip", default=None)
    air: Air | None = Key("added mass of air", default=None)
    damping: Damping | None = Key("damping of the vibration", default=None)
    impact: Impact | None = Key("impact on the film", default=None)
    vibration: Vibration | None = Key("vibration analysis; all defaults if absent", default=None)
    scissor: Scissor | None = Key('scissor array; required for "scissor"', default=None)
    bar: BarSection | None = Key("cross section of the bars of the array", default=None)
    hinge: HingeJoint | None = Key("springs, dampers and friction of the hinges of the array", default=None)
    stop: Stop | None = Key("end stop of the middle hinges of the array", default=None)
    hold: tuple[PointSupport, ...] = Key("supports of the array, `[[hold]]`", default=())
    force: tuple[PointForce, ...] = Key("forces on points of the array, `[[force]]`", default=())
    gravity: tuple[Acceleration, Acceleration, Acceleration] = Key("acceleration, inertial axes", default=(0.0, 0.0, 0.0))
    solve: Solve = Key("settings of the solver", default=Solve())
    save: Save = Key("spacing of records", default=Save())
    report: tuple[Annotated[str, Field(min_length=1, max_length=200)], ...] = Key(
        "channels that lead the printed results, the summary, tables and figures, as in `save.channels`; those "
        'of joints by the name of the joint: `["hinge 1.angle"]`', default=(),
        shown="coordinates of all ideal joints, and moments or forces of their motors",
    )  # fmt: skip
    expect: dict[str, Expect] = Field(default_factory=dict, description="expected numbers of the summary")

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
            creased = self.sheet is None or not self.sheet.has_no_creases
            if part is not None and (self.material is None or (self.crease is None and creased)):
                raise ValueError(f"[{name}] needs [material]" + (" and [crease]" if creased else ""))
        return self


def root(data: Mapping[str, Any]) -> Place:
    """Place (path and type) of a whole case."""
    return Place(Case, data, {})
