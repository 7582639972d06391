"""Lines of `fsm check` on gas in chambers and on orifices."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fsm.case.models.chambers import Chamber
from fsm.case.models.flexible_facets import FlexibleFacets
from fsm.case.models.gas import Gas
from fsm.check.view import CheckContext
from fsm.text.shown_units import count, shown

_CELSIUS = 273.15


def gas_lines(view: CheckContext) -> Iterator[str]:
    """Lines on every chamber, its gas and its supply, and on orifices."""
    for chamber in view.scene.built.chambers:
        yield _chamber(chamber)
        yield from _gas(chamber)
    for orifice in view.scene.built.orifices:
        between = " and ".join(orifice.between)
        if orifice.area is not None:
            size = shown(orifice.area, "m^2")
        else:
            ends = [f"{shown(area, 'm^2')} at {shown(angle, 'rad')}" for angle, area in orifice.area_by_angle]
            size = f"by the angle of {orifice.crease}: {', '.join(ends)}"
        yield f"orifice between {between}: {size}, discharge coefficient {orifice.discharge:.4g}"
    if view.scene.built.chambers:
        facets = view.scene.built.facets
        if facets is not None and (facets.mesh.creases or any(chamber.caps for chamber in view.scene.built.chambers)):
            yield f"chambers have straight edges between nodes: {_error_of_edges(facets)}"
        yield "steps of a case with gas are computed in Python, more slowly than compiled steps"


def _error_of_edges(facets: FlexibleFacets | None) -> str:
    """Error of a polygon in place of a circle: sides that turn by a give cos(a/2) of the force and sin(a)/a of the area."""
    if facets is None or not facets.mesh.curved:
        return "the volume has an error of the order of the squared cell size"
    mesh = facets.mesh
    normals = np.cross(mesh.slopes[:, 0], mesh.slopes[:, 1])[mesh.triangles]
    turned = float(np.arccos(np.clip((normals * np.roll(normals, -1, axis=1)).sum(axis=2), -1.0, 1.0)).max())
    return (
        f"cells that turn by {shown(turned, 'rad')} around a cylinder make its hoop force {100 * turned**2 / 8:.2g} % and "
        f"its volume {100 * turned**2 / 6:.2g} % too small"
    )


def _chamber(chamber: Chamber) -> str:
    gas = chamber.gas
    closings = [f"plane {one.axis} = {shown(one.at, 'm')}" for one in gas.closed_by if one.axis is not None]
    closings += [f"lid on {one.cap}" for one in gas.closed_by if one.cap is not None]
    closed = f", closed by {', '.join(closings)}" if closings else ""
    side = "" if chamber.sign > 0.0 else "; the normals of the facets point into it"
    return (
        f"{gas.name}: {count(len(chamber.facets), 'facet')} of {shown(chamber.area, 'm^2')} around "
        f"{shown(chamber.volume, 'm^3')} at the start{closed}{side}"
    )


def _gas(chamber: Chamber) -> Iterator[str]:
    gas = chamber.gas
    law = "isothermal, p V = m R T" if gas.law == "isothermal" else f"adiabatic, p V^{gas.heat_ratio:g} constant"
    warm = f"{gas.temperature:g} K ({gas.temperature - _CELSIUS:.4g} deg C), R = {gas.gas_constant:g} J/(kg K)"
    yield f"  {law}; {warm}; outside {shown(gas.outside_pressure, 'Pa')}"
    if gas.supply_pressure is None:
        mass = gas.at_start * chamber.volume / (gas.gas_constant * gas.temperature)
        yield f"  {shown(gas.at_start, 'Pa')} and {shown(mass, 'kg')} at the start"
    yield f"  {_supply(gas)}"


def _supply(gas: Gas) -> str:
    kind = gas.time.kind if gas.time else "constant"
    if gas.supply_pressure is not None:
        return f"pressure {shown(gas.supply_pressure, 'Pa')}, {kind}"
    if gas.supply_flow is not None:
        return f"mass flow {shown(gas.supply_flow, 'kg/s')}, {kind}"
    if gas.supply_mass is not None:
        return f"supply of {shown(gas.supply_mass, 'kg')}, {kind}"
    return "no supply"
