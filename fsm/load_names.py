"""Names of loads in results, and the units of their sizes and displacements."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["MOMENT", "PRESSURE", "LoadUnits", "axis_labels", "force_name", "load_units"]

PRESSURE = ", pressure"
"""Text behind the name of a pressure on nodes in results: its size is in Pa, and its displacement is a volume, m^3."""
MOMENT = ", moment"
"""Text behind the name of a load without force: its size is in N m, and its displacement is a rotation, rad."""
_NUMBER = re.compile(r"#\d+$")
"""Number behind a name that occurs again."""


@dataclass(frozen=True)
class LoadUnits:
    """Units of a load in results, and the labels of its curve, whose displacements are 1000 times as large.

    Attributes
    ----------
    size, displacement : units
    load, curve : labels of the axes
    shown : unit of the displacement in the figure of the curve
    """

    size: str
    displacement: str
    load: str
    curve: str
    shown: str


_FORCE = LoadUnits("N", "m", "load (N)", "displacement along the load (mm)", "mm")
_UNITS = {
    MOMENT: LoadUnits("N m", "rad", "moment (N m)", "rotation about the moment (mrad)", "mrad"),
    PRESSURE: LoadUnits("Pa", "m^3", "pressure (Pa)", "swept volume (litre)", "litre"),
}


def load_units(name: str) -> LoadUnits:
    """Units of a load by its name."""
    return next((units for end, units in _UNITS.items() if _NUMBER.sub("", name).endswith(end)), _FORCE)


def force_name(name: str) -> str:
    """Name of a force in results: the given name, which must not read as a moment or a pressure."""
    return name if load_units(name) is _FORCE else f"{name}, force"


def axis_labels(names: Iterable[str]) -> tuple[str, str]:
    """Labels of displacement and load of the curves of loads."""
    kinds = list(dict.fromkeys(load_units(name) for name in names))
    return " or ".join(kind.curve for kind in kinds), " or ".join(kind.load for kind in kinds)
