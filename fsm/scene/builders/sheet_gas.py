"""Chambers of gas of a sheet."""

from __future__ import annotations

import numpy as np

from fsm.errors import CaseError, Fault
from fsm.scene.case import Case
from fsm.scene.gas import OUTSIDE, SUPPLIES, Gas, Orifice
from fsm.scene.patterns.chamber import Chamber, SheetSurface, chamber_of
from fsm.scene.scene import Scene
from fsm.scene.time_program import Ramp

__all__ = ["with_gas"]


def with_gas(case: Case, scene: Scene, surface: SheetSurface) -> Scene:
    """Scene of a sheet with the gas of its chambers.

    Raises
    ------
    CaseError
        A chamber is open or empty, or an orifice names an unknown gas or joins different gases.
    """
    if not case.gas:
        return scene
    _check_path(case)
    chambers = [chamber_of(_in_time(case, gas), surface, f"gas.{number}") for number, gas in enumerate(case.gas)]
    _check_names(case.gas)
    for number, orifice in enumerate(case.orifice):
        _check_orifice(orifice, chambers, f"orifice.{number}.between")
        data = scene.folds if scene.facets is None else scene.facets.folds
        names = () if data is None else tuple(data.names[k] for k in np.unique(data.joint[data.joint >= 0]))
        names = tuple(name for name in names if name.startswith("crease"))
        if orifice.crease is not None and orifice.crease not in names:
            known = f'the sheet has "{names[0]}" to "{names[-1]}"' if names else "the sheet has no creases"
            raise CaseError(Fault(f"orifice.{number}.crease", f'there is no "{orifice.crease}"; {known}'))
    return scene.with_chambers(tuple(chambers), case.orifice)


def _in_time(case: Case, gas: Gas) -> Gas:
    """Gas whose supply has a ramp over the run, if the run is static and the supply has no function of time."""
    method, end = case.solve.method, case.solve.end_time
    if gas.time is not None or end is None or method not in ("static", "arc-length"):
        return gas
    if all(getattr(gas, name) is None for name in SUPPLIES):
        return gas
    shape = "unbounded" if method == "arc-length" else "linear"
    return gas.model_copy(update={"time": Ramp(kind="ramp", start=0.0, end=end, shape=shape)})


def _check_path(case: Case) -> None:
    """A path by arc length has no history, because its program time may decrease."""
    if case.solve.method != "arc-length" and not any(
        step.solve is not None and step.solve.method == "arc-length" for step in case.step
    ):
        return
    for number, gas in enumerate(case.gas):
        if gas.law == "adiabatic" and (gas.supply_flow is not None or gas.supply_mass is not None):
            text = 'of a supplied gas depends on the history, and a path by arc length has none; give "isothermal"'
            raise CaseError(Fault(f"gas.{number}.law", f'"adiabatic" {text}'))
    if case.orifice:
        text = 'flow takes time, and a path by arc length has none; remove [[orifice]], or give method = "static"'
        raise CaseError(Fault("orifice", text))


def _check_names(gases: tuple[Gas, ...]) -> None:
    names = [gas.name for gas in gases]
    for number, name in enumerate(names):
        if name in names[:number] or name == OUTSIDE:
            text = f"{name!r} is the name of another gas" if name != OUTSIDE else f"{OUTSIDE!r} are the surroundings"
            raise CaseError(Fault(f"gas.{number}.name", f"{text}; give another name"))


def _check_orifice(orifice: Orifice, chambers: list[Chamber], path: str) -> None:
    gases = {chamber.gas.name: chamber.gas for chamber in chambers}
    for name in orifice.between:
        if name not in gases and name != OUTSIDE:
            known = ", ".join([*map(repr, gases), repr(OUTSIDE)])
            raise CaseError(Fault(path, f"there is no gas {name!r}; give two of {known}"))
    joined = [gases[name] for name in orifice.between if name in gases]
    for key in ("gas_constant", "heat_ratio", "law"):
        values = [getattr(gas, key) for gas in joined]
        if values[0] != values[-1]:
            text = f"joins gases with {key} = {values[0]} and {values[-1]}, which would mix; give both the same"
            raise CaseError(Fault(path, text))
