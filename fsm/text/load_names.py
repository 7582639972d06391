"""Names of loads in results, and the units of their sizes and displacements."""

from __future__ import annotations

import re
from dataclasses import dataclass

PRESSURE = ", pressure"
"""Text behind the name of a pressure on nodes in results: its size is in Pa, and its displacement is a volume, m^3."""
MOMENT = ", moment"
"""Text behind the name of a load without force: its size is in N m, and its displacement is a rotation, rad."""
_NUMBER = re.compile(r"#\d+$")
"""Number behind a name that occurs again."""


@dataclass(frozen=True)
class LoadUnits:
    """Units of a load in results, and the words of its curve.

    Attributes
    ----------
    size, displacement : SI units
    load, curve : labels of the axes, without units
    way : short word for the displacement
    """

    size: str
    displacement: str
    load: str
    curve: str
    way: str


_FORCE = LoadUnits("N", "m", "load", "displacement along the load", "displacement")
_UNITS = {
    MOMENT: LoadUnits("N m", "rad", "moment", "rotation about the moment", "rotation"),
    PRESSURE: LoadUnits("Pa", "m^3", "pressure", "swept volume", "volume"),
}


def load_units(name: str) -> LoadUnits:
    """Units of a load by its name."""
    return next((units for end, units in _UNITS.items() if _NUMBER.sub("", name).endswith(end)), _FORCE)


def force_name(name: str) -> str:
    """Name of a force in results: the given name, which must not read as a moment or a pressure."""
    return name if load_units(name) is _FORCE else f"{name}, force"
