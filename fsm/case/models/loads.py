"""Loads and drives of a scene: wrenches as functions of time, and prescribed motions."""

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.time_program import Constant, Ramp, Table, TimeFunction, normalised, steepest
from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Angle, AngularSpeed, Count, Force, ForceOfLine, Length, Moment, Number, Speed, Stress

Vector = tuple[float, float, float]
Box = tuple[tuple[Length, Length, Length], tuple[Length, Length, Length]]
"""Two opposite corners of a box."""
DrivenEdge = Literal["bottom", "top", "left", "right", "inner", "outer", "slit-start", "slit-end"]
"""Named edges; a lattice has only the first four."""


PART = ", vertex "
"""Separator between the name of a load and the number of a vertex, in the name of the part of the load on this vertex."""


class Load(Model):
    """Wrench on a body or on a place of flexible facets: a force at a point and a couple, times a function of time.

    If the table of `time` has a column `force` or `moment`, the vector gives the direction only.
    """

    name: Name | None = Key(
        "name for a change or `release` in a later step", default=None, shown='"load on" its body or place'
    )
    body: str | None = Key('name of the body, in a strip for example "panel 3 segment 1"; give this or `at`', default=None)
    at: Name | Box | None = Key(
        "place of a sheet, as in `[[sheet.support]]`. Vertices share `force` in equal parts; flexible facets "
        "also share `moment`", default=None,
    )  # fmt: skip
    point: tuple[Length, Length, Length] = Key(
        "point of the force, in body axes from the centre of mass", default=(0.0, 0.0, 0.0)
    )
    force: tuple[Force, Force, Force] = Key("force, inertial axes", default=(0.0, 0.0, 0.0))
    moment: tuple[Moment, Moment, Moment] = Key("couple, inertial axes", default=(0.0, 0.0, 0.0))
    force_per_length: tuple[ForceOfLine, ForceOfLine, ForceOfLine] = Key(
        "force along an edge of flexible facets", default=(0.0, 0.0, 0.0)
    )
    moment_per_length: tuple[Force, Force, Force] = Key("couple along an edge of flexible facets", default=(0.0, 0.0, 0.0))
    pressure: Stress | None = Key(
        'pressure on facets of a sheet, with `at = "all"`, "facet 3" or "facets 1, 2". The pressure stays '
        "normal to the deformed facets; a positive pressure acts along their normals", default=None,
    )  # fmt: skip
    follower: bool = Key("force and moment are in body axes", default=False)
    time: TimeFunction | None = Key("factor over time: a ramp, a table or a cycle", default=None, shown="constant")
    step: str | None = Key("step in which the load begins", default=None, shown="the first")

    @property
    def called(self) -> str:
        """Name of the load."""
        return self.name or f"load on {self.target}"

    @property
    def target(self) -> str:
        """Name of the body or place."""
        return str(self.at if self.body is None else self.body)

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        if (self.body is None) == (self.at is None):
            both = "both are given; remove one of them" if self.at is not None else "both are missing"
            raise ValueError(f"give `body` (its name), or `at` (a place of a sheet); {both}")
        if self.at is None and (any(self.force_per_length) or any(self.moment_per_length)):
            raise ValueError("`force_per_length` and `moment_per_length` need `at`, an edge of flexible facets")
        return self

    @model_validator(mode="after")
    def _pressure_alone(self) -> Self:
        if self.pressure is None and not (isinstance(self.time, Table) and self.time.amount == "pressure"):
            return self
        if not isinstance(self.at, str):
            raise ValueError('`pressure` acts on facets of a sheet; give `at`, for example "all" or "facets 1, 2"')
        others = ("point", "force", "moment", "force_per_length", "moment_per_length")
        given = [f"`{name}`" for name in others if any(getattr(self, name))]
        if given or self.follower:
            text = ", ".join([*given, *(["`follower`"] if self.follower else [])])
            raise ValueError(f"`pressure` is a separate load, normal to the facets; remove {text}, or give two loads")
        return self

    @model_validator(mode="after")
    def _with_factors(self) -> Self:
        table = self.time
        if not isinstance(table, Table) or table.amount is None:
            return self
        name = table.amount
        if name not in ("force", "moment", "pressure"):
            raise ValueError(f"the table of a load has the column `force`, `moment` or `pressure`, not `{name}`")
        if name == "pressure":
            if self.pressure is not None:
                raise ValueError("`pressure` is given here and in the table; remove one of them")
            time, largest = normalised(table, "linear")
            object.__setattr__(self, "time", time)
            object.__setattr__(self, name, largest)
            return self
        vector: Vector = getattr(self, name)
        size = math.hypot(*vector)
        if size == 0.0:
            raise ValueError(f"a table with the column `{name}` needs its direction, for example {name} = [0, 0, 1]")
        if any(self.moment if name == "force" else self.force):
            raise ValueError(f"a table has `{name}` or another amount, not both; give force and moment as two loads")
        time, largest = normalised(table, "linear")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, name, tuple(largest * x / size for x in vector))
        return self


class Drive(Model):
    """Prescribed motion of a part of a strip, of bodies, or of an edge of a lattice; its reaction is the drive force.

    Give one of `crease`, `panel`, `end`, `body`, `bodies`, `edge` and `at`, and one of `travel` and `turn`.
    With `speed` or `rate` the motion has a smooth start and then a constant speed; with `time` it is a function of time.
    """

    name: Name | None = Key("name for `release` in a later step", default=None, shown='name of the driven part, "crease 3"')
    crease: Count | None = Key(
        "driven crease line of a strip; a drive has one of `crease`, `panel`, `end`, `body`, `bodies`, `edge` " "and `at`",
        default=None, within="1 to panels - 1, not of a held panel"
    )  # fmt: skip
    panel: Count | None = Key(
        "driven panel of a strip, gripped as a whole: its segments translate without rotation, or turn", default=None,
        within="1 to panels, not held"
    )  # fmt: skip
    end: Literal["first", "last"] | None = Key(
        "driven end line of a strip, about which the panel there can rotate", default=None
    )
    body: str | None = Key(
        "driven body: with `travel` it translates without rotation, with `turn` it rotates about a fixed axis", default=None
    )
    bodies: Annotated[tuple[str, ...], Field(min_length=1)] | None = Key(
        "driven bodies, which move together; the drive force is the sum over all bodies", default=None
    )
    edge: DrivenEdge | None = Key(
        "driven edge of a lattice (the first four), whose squares translate together without rotation, or of a " "sheet",
        default=None
    )  # fmt: skip
    at: Name | Box | None = Key("driven place of a sheet, as in `[[sheet.support]]`", default=None)
    direction: tuple[Number, Number, Number] = Key(
        "direction of the motion, of any length", default=(0.0, 0.0, 1.0), within="not zero"
    )
    speed: Annotated[Speed, Field(gt=0)] | None = Key(
        "speed after the run-up; give this or `time` with a travel", default=None
    )
    travel: Annotated[Length, Field(gt=0)] | None = Key("displacement; give this or `turn`", default=None)
    run_up: Annotated[Length, Field(ge=0)] | None = Key(
        "travel over which the speed increases from zero", default=None, shown="1 % of the travel", within="0 to travel"
    )
    turn: Annotated[Angle, Field(gt=0)] | None = Key(
        "rotation about the axis. A place of flexible facets is then clamped in a rigid end", default=None
    )
    rate: Annotated[AngularSpeed, Field(gt=0)] | None = Key(
        "angular speed after a run-up of 1 % of the turn; give this or `time` with a turn", default=None
    )
    axis: tuple[Number, Number, Number] = Key(
        "direction of the axis of a turn; in the plane along y", default=(0.0, 1.0, 0.0), within="not zero"
    )
    point: tuple[Length, Length, Length] | None = Key(
        "point on the axis, in space", default=None,
        shown="center of mass of the first body, or centre of the place of a sheet"
    )  # fmt: skip
    time: TimeFunction | None = Field(
        default=None,
        description="program over time, a [function of time](#functions-of-time) that multiplies `travel` or `turn`",
    )
    step: str | None = Key("step in which the drive begins", default=None, shown="the first")
    guide: bool = Key(
        "for a crease line or end line of a strip, and vertices of a sheet. true: no motion across the "
        "direction, and the line cannot rotate. false: only the motion along the direction is prescribed, in space. With "
        "`turn`, for flexible facets: false: the rigid end can translate, only its rotation is prescribed", default=True,
    )  # fmt: skip

    @property
    def moved(self) -> tuple[str, ...]:
        """Names of the driven bodies; empty for a crease or an edge."""
        return self.bodies or (() if self.body is None else (self.body,))

    @property
    def called(self) -> str:
        """Name of the drive."""
        if self.name is not None:
            return self.name
        return f"crease {self.crease}" if self.crease is not None else self.edge or str(self.at or self.part)

    @property
    def part(self) -> str:
        """Name of the driven bodies: a panel, an end of a strip, successive segments, or the names of all bodies."""
        if self.panel is not None:
            return f"panel {self.panel}"
        if self.end is not None:
            return f"{self.end} end"
        words = [name.rsplit(" segment ", 1) for name in self.moved]
        panels = {word[0] for word in words}
        numbers = [int(word[1]) for word in words if len(word) == 2 and word[1].isdecimal()]
        successive = numbers == list(range(numbers[0], numbers[0] + len(words))) if numbers else False
        if len(panels) == 1 and successive and len(numbers) > 1:
            return f"{panels.pop()} segments {numbers[0]} to {numbers[-1]}"
        return " + ".join(self.moved)

    def gripped(self, panels: int) -> int | None:
        """Number of the panel that the drive moves as a whole or at its end."""
        return self.panel if self.end is None else {"first": 1, "last": panels}[self.end]

    def line(self, panels: int) -> int | None:
        """Number of the driven line of a strip: of a crease, 0 for the first end, the number of panels for the last end."""
        return self.crease if self.end is None else {"first": 0, "last": panels}[self.end]

    @property
    def size(self) -> float:
        """Travel (m) or turn (rad)."""
        size = self.turn if self.travel is None else self.travel
        assert size is not None
        return size

    @property
    def fastest(self) -> float:
        """Largest speed, m/s or rad/s."""
        if self.time is not None:
            return self.size * steepest(self.time)
        speed = self.speed if self.turn is None else self.rate
        assert speed is not None
        return speed

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        targets = (self.crease, self.panel, self.end, self.body, self.bodies, self.edge, self.at)
        if sum(target is not None for target in targets) != 1:
            of_strip = "`crease` or `panel` (its number) or `end` (\"first\" or \"last\") of a strip"
            text = "`body` (its name), `bodies`, `edge` (of a lattice or sheet), or `at` (of a sheet)"
            raise ValueError(f"give one of {of_strip}, {text}")
        if not any(self.direction):
            raise ValueError("direction [0, 0, 0] is not a direction; give for example [0, 0, 1]")
        self._read_table()
        if (self.travel is None) == (self.turn is None) and not self._waits_for_file:
            both = "both are given; remove one of them" if self.turn is not None else "both are missing"
            raise ValueError(f"give `travel` (a length) or `turn` (an angle); {both}")
        if self.turn is not None:
            self._check_turn()
        elif self.rate is not None:
            raise ValueError("`rate` belongs to `turn`; give `speed` with `travel`")
        pace, key = (self.rate, "rate") if self.turn is not None else (self.speed, "speed")
        if self.time is None and pace is None:
            raise ValueError(f"`{key}` is missing; give `{key}`, or give `time` as a function of time")
        if self.time is not None and (pace is not None or self.run_up is not None):
            raise ValueError(f"`time` gives the motion; remove `{key}` and `run_up`, or remove `time`")
        if isinstance(self.time, Constant):
            raise ValueError('`time` of a drive is a motion: kind = "ramp", "table" or "cycle"')
        if isinstance(self.time, Ramp) and self.time.shape == "unbounded":
            raise ValueError('shape = "unbounded" is for loads; a drive has "smooth" or "linear"')
        if self.time is not None and not self._waits_for_file:
            self._check_begin(self.time)
        if self.run_up is not None and self.travel is not None and self.run_up > self.travel:
            raise ValueError(
                f"run_up = {self.run_up:g} m must be at most travel = {self.travel:g} m; reduce run_up"
            )
        return self

    def _check_begin(self, time: TimeFunction) -> None:
        """Check that the function of a drive is zero at time zero, because a drive starts from the initial positions of its
        bodies.
        """
        begin = time.time[0] if isinstance(time, Table) and time.time is not None else getattr(time, "start", 0.0)
        if begin < 0.0:
            raise ValueError(f"`time` begins at {begin:g} s; times count from the start of the step: give times from 0 s on")
        if isinstance(time, Table) and time.value is not None and time.value[0] != 0.0:
            amount = f"{self.size * time.value[0]:g} {'m' if self.turn is None else 'rad'}"
            raise ValueError(
                f"the table begins with {amount}, but a drive begins at the positions of its bodies; count travel or "
                "turn from there: the first row must be 0"
            )

    @property
    def _waits_for_file(self) -> bool:
        return isinstance(self.time, Table) and self.time.file is not None

    def _check_turn(self) -> None:
        if self.crease is not None or self.end is not None:
            raise ValueError("`turn` rotates a `panel`, `body`, `bodies` or place of a sheet; a crease or end has `travel`")
        if not any(self.axis):
            raise ValueError("axis [0, 0, 0] is not a direction; give for example [0, 1, 0]")
        if self.speed is not None or self.run_up is not None:
            raise ValueError("`turn` has a `rate` (rad/s) and no `speed` or `run_up`; remove `speed` and `run_up`")

    def _read_table(self) -> None:
        """Convert a table with units to factors, and find the travel or turn at which the factor is 1."""
        table = self.time
        if not isinstance(table, Table):
            return
        if table.amount is None:
            object.__setattr__(self, "time", table.model_copy(update={"interpolation": table.interpolation or "smooth"}))
            return
        name = table.amount
        if name not in ("travel", "turn"):
            raise ValueError(f"the table of a drive has the column `travel` or `turn`, not `{name}`")
        if getattr(self, name) is not None:
            raise ValueError(f"`{name}` is given here and in the table; remove one of them")
        time, largest = normalised(table, "smooth")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, name, largest)
