"""Sections [[gas]] and [[orifice]] of a case: gas in closed chambers of a sheet, and flow between them."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.case.models.time_program import Table, TimeFunction
from fsm.case.schema.model import Key, Model, Name
from fsm.case.schema.units import Angle, Area, GasConstant, Length, Mass, MassFlow, Number, Stress, Temperature

SUPPLIES = ("supply_pressure", "supply_flow", "supply_mass")
"""Keys that give the amount of gas; a chamber may have only one of them."""
OUTSIDE = "outside"
"""Name of the surroundings in `orifice.between`."""


class Closing(Model):
    """Closing of a chamber at open edges by a plane or by a lid. Give `axis` or `cap`.

    A plane is a plane of symmetry or a fixed wall. A lid is massless. A lid is a cone with its tip at the mean position of
    the nodes of its ring; the lid of a flat ring is flat. A part of a ring between planes has the tip of the whole ring,
    which mirror images complete. The work of its forces is the pressure times the change of the volume.
    """

    axis: Literal["x", "y", "z"] | None = Key(
        "normal of a plane of symmetry or a fixed wall, in which the open edges are held; give this or `cap`", default=None
    )
    at: Length = Key("position of the plane along its normal", default=0.0)
    cap: Name | None = Key(
        'ring of open edges under a massless lid: "edge top", or a vertex on the ring, "vertex 7". A chain of '
        "open edges whose two ends lie in one plane of `closed_by` is half of a ring; with one end in each of two planes "
        "it is a quarter", default=None,
    )  # fmt: skip

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.axis is None) == (self.cap is None):
            both = "both are given; remove one of them" if self.axis is not None else "both are missing"
            raise ValueError(f"give `axis` (normal of a plane) or `cap` (place of a lid); {both}")
        if self.cap is not None and self.at:
            raise ValueError("`at` is the position of a plane along `axis`; remove it beside `cap`")
        return self


class Gas(Model):
    """Gas in a chamber: facets that enclose a volume, with planes and lids that close it.

    Pressures are absolute. The force on the facets is the pressure above `outside_pressure` times the gradient of the
    volume. Give at most one supply; without a supply, the chamber keeps its gas.
    """

    name: Name = Key("name for channels and orifices", default="gas")
    at: Name = Key('facets around the chamber: "all", "facet 3" or "facets 1, 2"', default="all")
    closed_by: tuple[Closing, ...] = Key(
        "planes and lids that close the chamber at open edges: `axis` and `at` of a plane of symmetry, or a "
        "lid on an edge", default=(),
    )  # fmt: skip
    law: Literal["isothermal", "adiabatic"] = Key(
        '"adiabatic": no heat is exchanged with the surroundings', default="isothermal"
    )
    gas_constant: GasConstant = Key("gas constant R of the gas; the default is that of air", default=287.06, gt=0)
    heat_ratio: Number = Key("ratio of the heat capacities", default=1.4, gt=1, le=2)
    temperature: Temperature = Key(
        "temperature of the gas at the start, of the supply and of the surroundings", default=293.15, gt=0
    )
    pressure: Annotated[Stress, Field(ge=0)] | None = Key("pressure at the start", default=None, shown="`outside_pressure`")
    outside_pressure: Stress = Key("pressure around the sheet", default=0.0, ge=0)
    supply_pressure: Annotated[Stress, Field(ge=0)] | None = Key(
        "pressure of the chamber at factor 1; give at most one supply", default=None
    )
    supply_flow: MassFlow | None = Key("mass flow into the chamber at factor 1", default=None)
    supply_mass: Mass | None = Key("mass of gas at factor 1, in addition to the gas at the start", default=None)
    time: TimeFunction | None = Key(
        "factor over the time of the whole run, as of a `[[load]]`. In statics without this key: `supply_mass` "
        "and `supply_pressure` have a ramp until `solve.end_time`; a `supply_pressure` begins at `outside_pressure`; a "
        "`supply_flow` is constant", default=None, shown="constant",
    )  # fmt: skip

    @property
    def at_start(self) -> float:
        """Absolute pressure at the start without supply, Pa."""
        return self.outside_pressure if self.pressure is None else self.pressure

    @model_validator(mode="after")
    def _one_supply(self) -> Self:
        given = [name for name in SUPPLIES if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"`{given[0]}` and `{given[1]}` are given; give one supply")
        if isinstance(self.time, Table) and self.time.amount is not None:
            raise ValueError(f"the table of a supply has `{self.time.amount}`; give the column `value` (factors) instead")
        if self.time is not None and not given:
            raise ValueError("`time` multiplies a supply, and there is none; give `supply_mass`, or remove `time`")
        if self.supply_pressure is not None and self.pressure is not None:
            raise ValueError("`supply_pressure` gives the pressure at all times; remove `pressure`")
        if self.supply_pressure is not None and self.law == "adiabatic":
            raise ValueError('`supply_pressure` gives the pressure, so heat has no effect; remove law =  "adiabatic"')
        return self


class Orifice(Model):
    """Orifice through which gas flows between two chambers, or between a chamber and the surroundings.

    The mass flow is that of an ideal gas through a nozzle; the flow is choked below the critical ratio of pressures.
    """

    between: tuple[Name, Name] = Key('names of two gases, or of one and "outside"')
    area: Annotated[Area, Field(ge=0)] | None = Key("constant area of the opening; give this or `crease`", default=None)
    crease: Name | None = Key('name of a crease, "crease 3", whose mean fold angle gives the area', default=None)
    area_by_angle: tuple[tuple[Angle, Annotated[Area, Field(ge=0)]], ...] = Key(
        'pairs of the magnitude of the angle (0 flat) and the area (m^2), `[["0 deg", 0], ["90 deg", "20 '
        'mm^2"]]`: linear between them, constant beyond', default=(), within="increasing angles",
    )  # fmt: skip
    discharge: Number = Key("mass flow over that of an ideal nozzle", default=1.0, gt=0, le=1)

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.between[0] == self.between[1]:
            raise ValueError(f"`between` names {self.between[0]!r} twice; give two gases, or one and {OUTSIDE!r}")
        if (self.area is None) == (self.crease is None):
            both = "both are given; remove one of them" if self.crease is not None else "both are missing"
            raise ValueError(f"give `area`, or `crease` with `area_by_angle`; {both}")
        angles = [angle for angle, _ in self.area_by_angle]
        if (self.crease is None) != (not angles) or len(angles) == 1:
            raise ValueError(
                "`crease` and `area_by_angle` belong together; "
                "give both, with two or more pairs, or remove both"
            )
        if any(b <= a for a, b in pairwise(angles)):
            raise ValueError("the angles of `area_by_angle` must increase")
        return self
