"""Sections [[gas]] and [[orifice]] of a case: gas in closed chambers of a sheet, and flow between them."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.time_program import Table, TimeFunction
from fsm.scene.units import Angle, Area, GasConstant, Length, Mass, MassFlow, Number, Stress, Temperature

__all__ = ["OUTSIDE", "SUPPLIES", "Closing", "Gas", "Orifice"]

SUPPLIES = ("supply_pressure", "supply_flow", "supply_mass")
"""Keys that give the amount of gas; a chamber may have only one of them."""
OUTSIDE = "outside"
"""Name of the surroundings in `orifice.between`."""


class Closing(Model):
    """Closing of a chamber at open edges by a plane or by a lid. Give `axis` or `cap`.

    A plane is a plane of symmetry or a fixed wall. A lid is massless. A lid is a cone with its tip at the mean position of
    the nodes of its ring; the lid of a flat ring is flat. A part of a ring between planes has the tip of the whole ring,
    which mirror images complete. The work of its forces is the pressure times the change of the volume.

    Attributes
    ----------
    axis : normal of the plane
    at : position of the plane along the axis, m
    cap : ring of open edges under a lid: a named edge of the sheet ("edge top"), or a vertex on the ring ("vertex 7")
    """

    axis: Literal["x", "y", "z"] | None = None
    at: Length = 0.0
    cap: Name | None = None

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

    Attributes
    ----------
    name : name for channels and orifices
    at : str
        Facets around the chamber: "all", "facet 3" or "facets 1, 2".
    closed_by : planes and lids that close the chamber at open edges
    law : str
        "isothermal": p V = m R T. "adiabatic": p V^gamma is constant without supply and flow.
    gas_constant : J/(kg K)
    heat_ratio : -
        Ratio of the heat capacities, gamma.
    temperature : K
        Of the gas at the start, of the supply, and of the surroundings.
    pressure : Pa
        At the start; absent: `outside_pressure`.
    outside_pressure : Pa
    supply_pressure, supply_flow, supply_mass : Pa, kg/s, kg
        Pressure of the chamber, mass flow into it, or mass of gas in addition to that of the start, times `time`.
    time : function of time of the whole run; absent: constant, or a ramp over the run in statics (a flow is constant)
    """

    name: Name = "gas"
    at: Name = "all"
    closed_by: tuple[Closing, ...] = ()
    law: Literal["isothermal", "adiabatic"] = "isothermal"
    gas_constant: Annotated[GasConstant, Field(gt=0)] = 287.06
    heat_ratio: Annotated[Number, Field(gt=1, le=2)] = 1.4
    temperature: Annotated[Temperature, Field(gt=0)] = 293.15
    pressure: Annotated[Stress, Field(ge=0)] | None = None
    outside_pressure: Annotated[Stress, Field(ge=0)] = 0.0
    supply_pressure: Annotated[Stress, Field(ge=0)] | None = None
    supply_flow: MassFlow | None = None
    supply_mass: Mass | None = None
    time: TimeFunction | None = None

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

    Attributes
    ----------
    between : names of two gases, or of one and "outside"
    area : m^2
        Constant area; give this or `crease`.
    crease : str
        Name of a crease, for example "crease 3", whose mean fold angle gives the area.
    area_by_angle : rad, m^2
        Pairs of the magnitude of this angle (0 flat) and the area, linear between them and constant beyond.
    discharge : -
        Ratio of the mass flow to that of an ideal nozzle.
    """

    between: tuple[Name, Name]
    area: Annotated[Area, Field(ge=0)] | None = None
    crease: Name | None = None
    area_by_angle: tuple[tuple[Angle, Annotated[Area, Field(ge=0)]], ...] = ()
    discharge: Annotated[Number, Field(gt=0, le=1)] = 1.0

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
