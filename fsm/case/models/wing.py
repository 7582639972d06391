"""Section [wing] of a case: panels in a row, folded along hinge lines."""

import math
import re
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.coupling import Elasticity
from fsm.case.models.flexible import Elements
from fsm.case.models.joint_action import HingeSpring, TurnDamper, TurnFriction, TurnHarness, TurnLatch, TurnStop
from fsm.case.models.joint_motor import TurnMotor
from fsm.case.schema.model import Key, Model
from fsm.case.schema.units import Angle, Count, Density, Length, Mass, Number, Stress, Time

_SQUARE = 1e-6
"""Cosine of the angle of two axes below which the angle is a right one."""
_FAILED = re.compile(r"(spring|damper|latch|motor|cable) (root|\d+|side \d+)")


class WingHinge(Model):
    """What acts in a hinge; angles are zero in the deployed wing and positive in the stowed wing."""

    spring: HingeSpring | None = Key("spring, or the law of a crease", default=None)
    damper: TurnDamper | None = Key("damper", default=None)
    friction: TurnFriction | None = Key("friction", default=None)
    harness: TurnHarness | None = Key("moment of a cable harness", default=None)
    stop: TurnStop | None = Key("stop", default=None)
    latch: TurnLatch | None = Key("latch", default=None)
    motor: TurnMotor | None = Key("motor", default=None)


class WingYoke(Model):
    """Frame between the base and the first panel."""

    length: Length = Key("size from the base to the first panel", gt=0)
    width: Length | None = Key("size along the hinge lines", default=None, gt=0, shown="that of the panels")
    thickness: Length | None = Key("thickness", default=None, gt=0, shown="that of the panels")
    mass: Mass = Key("mass, spread evenly over its area", gt=0)


class HoldDown(Model):
    """Clamp that keeps parts of the stowed wing and the base together until its release."""

    release: Time = Key("time of the release", gt=0)
    parts: tuple[str, ...] | None = Key(
        'parts that it clamps to each other: "base", "yoke", "panel 2", "side 3"', default=None, min_length=2,
        shown="the base and all parts"
    )  # fmt: skip


class SideRow(Model):
    """Second row of panels, folded sideways: each lies on its panel at the start and turns about one of its long edges."""

    panels: tuple[Count, ...] | None = Key(
        "numbers of the panels that have one", default=None, min_length=1, shown="the last",
        within="all different, at most `panels`"
    )  # fmt: skip
    width: Length | None = Key("size across the long edge", default=None, gt=0, shown="that of the panels")
    mass: Annotated[Mass, Field(gt=0)] | None = Key("mass, spread evenly", default=None, shown="as the panels, by area")
    edge: Literal["left", "right"] = Key(
        'edge of the panel: "left" is towards `hinge_axis`, "right" away from it', default="left"
    )
    stowed: Angle = Key("angle at the start; zero is deployed", default=math.pi, shown="180 deg")
    hinge: WingHinge = Key("what acts in its hinges, as in `hinge`", default=WingHinge())


class FlexiblePanels(Model):
    """Panels that bend. Hinges act on the edges of films ([frames](#scene-frames)), or on the ends of beams.

    The panels keep their mass, without the inertia of their thickness against rotation.
    """

    kind: Literal["beam", "film"] = Key(
        '"beam": panels bend about their hinge lines only, which must be along y; "film": they bend and twist, '
        "and steps take much longer", default="beam",
    )  # fmt: skip
    young: Stress = Key(
        "Young's modulus of a homogeneous panel of `thickness` with the bending stiffness of the real one", gt=0
    )
    poisson: Number = Key("films: Poisson's ratio", default=0.3, gt=-1, lt=0.5)
    mesh: tuple[Elements, Elements] = Key(
        "number of elements of each panel along its length, and with films along its width; elements of films "
        "are best about square", default=(4, 4),
    )  # fmt: skip
    viscosity: Time = Key("Kelvin-Voigt time, as of films and beams", default=0.0, ge=0)
    parts: tuple[str, ...] | None = Key(
        'panels that bend: "panel 2", "side 3"', default=None, min_length=1, shown="all panels; the yoke is rigid"
    )


class Wing(Model):
    """Rigid or flexible panels in a row, hinged to each other and to a base, and folded as an accordion at the start.

    Bodies are "yoke", if there is one, and "panel 1", "panel 2", ... from the base. "hinge k" is the hinge of panel k
    towards the base; "root" is that of the yoke.
    """

    panels: Count = Key("number of panels", ge=1, le=200)
    length: Length = Key("size of a panel from hinge line to hinge line", gt=0)
    width: Length = Key("size of a panel along the hinge lines", gt=0)
    thickness: Length = Key("thickness of a panel", gt=0)
    mass: Annotated[Mass, Field(gt=0)] | None = Key("mass of a panel, spread evenly; give `mass` or `density`", default=None)
    density: Annotated[Density, Field(gt=0)] | None = Key("mean density of a panel; give `mass` or `density`", default=None)
    gap: Length | None = Key(
        "distance between the middles of neighbouring stowed panels; hinge lines lie half of it off the middle",
        default=None, gt=0, shown="`thickness`"
    )  # fmt: skip
    yoke: WingYoke | None = Key("frame between the base and the first panel", default=None)
    base: str = Key('body that carries the wing: "ground", or a body of [scene]', default="ground")
    at: tuple[Length, Length, Length] = Key("middle of the hinge line on the base, inertial axes", default=(0.0, 0.0, 0.0))
    along: tuple[Number, Number, Number] = Key("direction of the deployed wing from the base", default=(1.0, 0.0, 0.0))
    hinge_axis: tuple[Number, Number, Number] = Key(
        "direction of the hinge lines, at a right angle to `along`", default=(0.0, 1.0, 0.0)
    )
    stowed: tuple[Angle, ...] | None = Key(
        "angles of the hinges at the start, from the base on; zero is deployed", default=None,
        shown="90 degrees on the base, 180 degrees between panels", within="one for each hinge"
    )  # fmt: skip
    hinge: WingHinge = Key("what acts in every hinge", default=WingHinge())
    root: WingHinge | None = Key("what acts in the hinge on the base", default=None, shown="as `hinge`")
    synchronisation: Literal["cable"] | None = Key(
        '"cable": cables with pulleys join each hinge to the next, so that all reach zero together; their '
        "ratios are those of the stowed angles, 2 : 1 at the root", default=None, shown="none",
    )  # fmt: skip
    cable: Elasticity | None = Key(
        "elasticity of the cables, on the angle of the hinge nearer to the base", default=None,
        shown="none, the cables are ideal"
    )  # fmt: skip
    hold_downs: tuple[HoldDown, ...] = Key("clamps of the stowed wing, each with the time of its release", default=())
    side: SideRow | None = Key("second row of panels, folded sideways", default=None)
    flexible: FlexiblePanels | None = Key("panels that bend", default=None, shown="all panels are rigid")
    failed: tuple[str, ...] = Key(
        'parts that do not act: `"spring 3"` is the spring of hinge 3; also `damper`, `latch` and `motor`; '
        '`"spring root"` with a yoke; `"cable 3"` ends at hinge 3; `"spring side 2"` is that of side 2', default=(),
    )  # fmt: skip

    @property
    def panel_mass(self) -> float:
        """Mass of a panel, kg."""
        return self.length * self.width * self.thickness * self.density if self.density is not None else self.mass or 0.0

    @property
    def hinges(self) -> tuple[str, ...]:
        """Names of the hinges from the base on, as in `failed`."""
        return (*(("root",) if self.yoke else ()), *(str(number) for number in range(1, self.panels + 1)))

    @property
    def side_panels(self) -> tuple[int, ...]:
        """Numbers of the panels with a panel of the second row."""
        if self.side is None:
            return ()
        return (self.panels,) if self.side.panels is None else self.side.panels

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the base and of all bodies of the wing."""
        yoke = ("yoke",) if self.yoke else ()
        panels = (f"panel {number}" for number in range(1, self.panels + 1))
        return ("base", *yoke, *panels, *(f"side {number}" for number in self.side_panels))

    @property
    def stowed_angles(self) -> tuple[float, ...]:
        """Angles of the hinges at the start, rad."""
        if self.stowed is not None:
            return self.stowed
        return (0.5 * math.pi, *(math.pi for _ in self.hinges[1:]))

    @model_validator(mode="after")
    def _synchronised(self) -> Self:
        if self.cable is not None and self.synchronisation is None:
            raise ValueError('`cable` needs `synchronisation = "cable"`')
        if self.synchronisation is not None and not all(self.stowed_angles):
            raise ValueError("cables need stowed angles that are not zero; their ratios are those of these angles")
        return self

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.mass is None) == (self.density is None):
            raise ValueError("give `mass` or `density` of a panel, one of them")
        count = len(self.hinges)
        if self.stowed is not None and len(self.stowed) != count:
            raise ValueError(f"`stowed` has {len(self.stowed)} angles, and the wing has {count} hinges; give one for each")
        sizes = math.hypot(*self.along), math.hypot(*self.hinge_axis)
        both = abs(sum(a * b for a, b in zip(self.along, self.hinge_axis, strict=True)))
        if not min(sizes) > 0.0 or both > _SQUARE * sizes[0] * sizes[1]:
            raise ValueError("`along` and `hinge_axis` must be two directions at a right angle")
        known = [*self.hinges, *(f"side {number}" for number in self.side_panels)]
        for name in self.failed:
            match = _FAILED.fullmatch(name)
            if match is None or match[2] not in known:
                named = ", ".join(known)
                text = "give spring, damper, latch, motor or cable, and one of the hinges"
                raise ValueError(f"failed part {name!r} is unknown: {text} {named}")
            if match[1] == "cable":
                if self.synchronisation is None or match[2] not in self.hinges[1:]:
                    raise ValueError(f"failed part {name!r}: no cable ends at this hinge")
            elif getattr(self.hinge_of(match[2]), match[1]) is None:
                raise ValueError(f"failed part {name!r}: this hinge has no {match[1]}")
        return self

    @property
    def flexible_parts(self) -> tuple[str, ...]:
        """Names of the panels that bend."""
        if self.flexible is None:
            return ()
        return self.flexible.parts or tuple(name for name in self.parts if name not in ("base", "yoke"))

    @model_validator(mode="after")
    def _bending(self) -> Self:
        if self.flexible is None:
            return self
        panels = [name for name in self.parts if name not in ("base", "yoke")]
        wrong = [name for name in self.flexible_parts if name not in panels]
        if wrong:
            raise ValueError(f"`flexible.parts`: no panel is called {wrong[0]!r}; the panels are {', '.join(panels)}")
        if self.flexible.kind == "beam":
            off = max(abs(self.along[1]) / math.hypot(*self.along), math.hypot(self.hinge_axis[0], self.hinge_axis[2]))
            if off > _SQUARE * math.hypot(*self.hinge_axis):
                raise ValueError('beams bend in the x-z plane; give hinge_axis = [0, 1, 0], or flexible.kind = "film"')
            if self.side is not None:
                raise ValueError('beams have no long edges for the hinges of `side`; give flexible.kind = "film"')
        return self

    @model_validator(mode="after")
    def _clamped(self) -> Self:
        numbers = self.side_panels
        if len(set(numbers)) < len(numbers) or any(number > self.panels for number in numbers):
            raise ValueError(f"`side.panels` has numbers from 1 to {self.panels}, each once; it is {list(numbers)}")
        for clamp in self.hold_downs:
            wrong = [name for name in clamp.parts or () if name not in self.parts]
            if wrong or len(set(clamp.parts or ())) < len(clamp.parts or ()):
                text = f"no part of the wing is called {wrong[0]!r}" if wrong else "a part is named twice"
                raise ValueError(f"`hold_downs`: {text}; the parts are {', '.join(self.parts)}")
        return self

    def hinge_of(self, name: str) -> WingHinge:
        """What acts in a hinge if nothing has failed."""
        if self.side is not None and name.startswith("side "):
            return self.side.hinge
        return self.root if self.root is not None and name == self.hinges[0] else self.hinge

    def acting(self, name: str) -> dict[str, Model]:
        """What acts in a hinge, by keys of a joint."""
        failed = {part.split(" ")[0] for part in self.failed if part.split(" ", 1)[1] == name}
        hinge = self.hinge_of(name)
        parts = {key: getattr(hinge, key) for key in WingHinge.model_fields if key not in failed}
        return {key: part for key, part in parts.items() if part is not None}


