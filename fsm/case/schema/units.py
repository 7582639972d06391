"""Units of input values: a value is a plain number, or text with a unit.

Each quantity is a type (`Length`, `Angle`, ...). The value is

* a plain number in the unit system of the file (``SI`` or ``mm-N-s``; angles are in radians in both), or
* text, for example ``"80 deg"``, ``"9 N mm/rad"`` or ``"1e9 N/m^1.5"``; text without a unit is a plain number.

Models hold SI values only.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

from pydantic import BeforeValidator, GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

# exponents of (length, mass, time, angle)
Dimension = tuple[float, float, float, float]

_L: Dimension = (1, 0, 0, 0)
_M: Dimension = (0, 1, 0, 0)
_T: Dimension = (0, 0, 1, 0)
_A: Dimension = (0, 0, 0, 1)
_NONE: Dimension = (0, 0, 0, 0)
_FORCE: Dimension = (1, 1, -2, 0)
_STRESS: Dimension = (-1, 1, -2, 0)
_ENERGY: Dimension = (2, 1, -2, 0)

UNITS: dict[str, tuple[float, Dimension]] = {
    "m": (1.0, _L), "km": (1e3, _L), "cm": (1e-2, _L), "mm": (1e-3, _L), "um": (1e-6, _L), "µm": (1e-6, _L),
    "nm": (1e-9, _L), "in": (0.0254, _L), "ft": (0.3048, _L),
    "kg": (1.0, _M), "g": (1e-3, _M), "mg": (1e-6, _M), "t": (1e3, _M), "lb": (0.45359237, _M),
    "s": (1.0, _T), "ms": (1e-3, _T), "us": (1e-6, _T), "min": (60.0, _T), "h": (3600.0, _T),
    "day": (86400.0, _T),
    "rad": (1.0, _A), "mrad": (1e-3, _A), "deg": (math.pi / 180, _A), "°": (math.pi / 180, _A),
    "rev": (2 * math.pi, _A), "turn": (2 * math.pi, _A),
    "N": (1.0, _FORCE), "mN": (1e-3, _FORCE), "uN": (1e-6, _FORCE), "kN": (1e3, _FORCE), "MN": (1e6, _FORCE),
    "gf": (9.80665e-3, _FORCE), "kgf": (9.80665, _FORCE), "lbf": (4.4482216152605, _FORCE),
    "Pa": (1.0, _STRESS), "kPa": (1e3, _STRESS), "MPa": (1e6, _STRESS), "GPa": (1e9, _STRESS),
    "psi": (6894.757293168361, _STRESS),
    "J": (1.0, _ENERGY), "mJ": (1e-3, _ENERGY), "Hz": (1.0, (0, 0, -1, 0)),
    "K": (1.0, _NONE),  # temperatures have no separate dimension
    "rpm": (2 * math.pi / 60, (0, 0, -1, 1)), "%": (1e-2, _NONE), "1": (1.0, _NONE),
}  # fmt: skip

# SI values of the units of length, mass, time and angle in each unit system
SYSTEMS: dict[str, tuple[float, float, float, float]] = {
    "SI": (1.0, 1.0, 1.0, 1.0),
    "mm-N-s": (1e-3, 1e3, 1.0, 1.0),
}

_SMALLEST, _LARGEST = 1e-60, 1e60
"""Range of values in SI."""
_LONGEST = 100
"""Largest number of characters of a number with its unit."""
_QUANTITY = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")
_NEWTON = re.compile(r"^([mukM]?N)((?:mm|cm|m|s)(?:\^[-+]?\d+)?)$")
"""Product of a force and a length or a time without a blank: Nmm, Nm, kNm, Ns."""
_FACTOR = re.compile(r"^([A-Za-zµ°%]+|1)(?:(?:\^|\*\*)?([-+]?\d+(?:\.\d+)?))?$")
_TYPED = str.maketrans({"\u03bc": "µ", "²": "^2", "³": "^3", "−": "-"})
# common words for units, with the symbol to use instead
_WORDS = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"), **dict.fromkeys(("degree", "degrees"), "deg"),
    **dict.fromkeys(("meter", "metre", "meters", "metres"), "m"), **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("micron", "microns", "micrometer"), "um"), **dict.fromkeys(("gram", "grams"), "g"),
    **dict.fromkeys(("hour", "hours", "hr"), "h"), **dict.fromkeys(("minute", "minutes", "mins"), "min"),
    **dict.fromkeys(("inch", "inches"), "in"), "days": "day", "pascal": "Pa", "radian": "rad", "radians": "rad",
    "percent": "%", "msec": "ms", "usec": "us",
}  # fmt: skip
# units of mm-N-s in place of units of SI
_NAMES_MM = {"m": "mm", "kg": "t", "Pa": "MPa", "J": "mJ"}


@lru_cache(maxsize=1024)  # a large scene repeats a few units many times
def parse_unit(text: str) -> tuple[float, Dimension]:
    """SI value and dimension of a unit such as ``N mm/rad``, ``kg/m^3`` or ``N/m^1.5``.

    Every ``/`` divides by the single factor after it (``N/m/s``); a blank, ``*`` or ``·`` multiplies.

    Raises
    ------
    ValueError
        The unit is unknown; the message names the unknown part.
    """
    value, dimension = 1.0, [0.0, 0.0, 0.0, 0.0]
    for position, part in enumerate(text.translate(_TYPED).replace("**", "^").split("/")):
        factors = [f for f in re.split(r"[\s*·]+", part.strip()) if f]
        if not factors and (position > 0 or "/" in text):
            raise ValueError(f"a factor is missing beside the / of the unit {text!r}; write, for example, N/m")
        for index, factor in enumerate(factors):
            joined = _NEWTON.match(factor)
            if joined is not None:  # as testing machines write it
                factors[index + 1 : index + 1] = [joined[2]]
                factor = joined[1]
            match = _FACTOR.match(factor)
            if match is None or match[1] not in UNITS:
                raise ValueError(f"unknown unit {factor!r}{_meant(factor, match[1] if match else factor)}")
            scale, dims = UNITS[match[1]]
            power = float(match[2]) if match[2] else 1.0
            if position > 0 and index == 0:
                power = -power
            value *= scale**power
            dimension = [d + power * e for d, e in zip(dimension, dims, strict=True)]
    length, mass, time, angle = dimension
    return value, (length, mass, time, angle)


def to_si(value: float | str, unit: str, system: str = "SI") -> float:
    """Value of a file in SI.

    Parameters
    ----------
    value : float or str
        Plain number in the unit system of the file, or text with a unit.
    unit : str
        SI unit of the quantity, e.g. ``"N m/rad"``, which gives the required dimension.
    system : str
        Unit system of plain numbers, a key of `SYSTEMS`.

    Raises
    ------
    ValueError
        The value is not a number, or its unit is unknown or has another dimension.
    """
    required = f"give a value in {unit_in(unit, system)}" if unit else "give a plain number"
    _, dimension = parse_unit(unit)
    number, text = _split(value, required)
    if text:
        scale, given = _given_unit(value, text, required)
        if "%" in text and dimension != _NONE:
            raise ValueError(f'"{value}" is a percentage; {required}')
        _check_dimension(given, dimension, f'"{value}" has the wrong unit; {required}')
        if dimension[3] != 0 and re.search(r"\bHz\b", text):
            raise ValueError(f'"{value}" may mean turns or radians; write rev/s or rad/s')
    else:
        scale = math.prod(base**power for base, power in zip(SYSTEMS[system], dimension, strict=True))
    result = number * scale
    if not math.isfinite(result):
        raise ValueError(f"{value} is not a finite number; {required}")
    if not _in_range(result):
        raise ValueError(f"{with_unit(value, None)} is outside {_SMALLEST:g} to {_LARGEST:g} in SI; {required}")
    return result


def _in_range(value: float) -> bool:
    """Whether products of several such values are finite and not zero."""
    return value == 0.0 or _SMALLEST <= abs(value) <= _LARGEST


def _split(value: float | str, required: str) -> tuple[float, str]:
    """Number and unit of an input value."""
    if isinstance(value, str):
        if len(value) > _LONGEST:
            raise ValueError(f"{with_unit(value, None)} has more than {_LONGEST} characters; {required}")
        match = _QUANTITY.match(value)
        comma = re.match(r"\s*[-+]?[\d.]*\d,\d[\d.,]*", value)
        if comma is not None:
            raise ValueError(f"{with_unit(value, None)} has a comma; {_without_comma(value)}; {required}")
        if match is None:
            raise ValueError(f"{with_unit(value, None)} is not a number; {required}")
        if re.match(r"\d", match[2]) and not re.match(r"1(?!\d)", match[2]):
            raise ValueError(f"{with_unit(value, None)} has a blank within the number; {required}")
        return float(match[1]), match[2]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{with_unit(value, None)} is not a number; {required}")
    try:
        return float(value), ""
    except OverflowError:
        raise ValueError(f"the whole number has too many digits; {required}") from None


def _without_comma(value: str) -> str:
    """Advice for a number that is written with a comma."""
    if re.match(r"\s*[-+]?\d+,\d+(?![\d.,])", value) is None:
        return "write a decimal point and no other separators"
    thousands = re.match(r"\s*[-+]?[1-9]\d{0,2},\d{3}(?!\d)", value) is not None
    point = f'"{value.replace(",", ".", 1)}"'
    return f'write {point} with a decimal point' + (f', or "{value.replace(",", "", 1)}" for thousands' if thousands else "")


def _given_unit(value: float | str, text: str, required: str) -> tuple[float, Dimension]:
    try:
        return parse_unit(text)
    except ValueError as error:
        raise ValueError(f'"{value}": {error}; {required}') from None


def _meant(factor: str, name: str) -> str:
    """Suggestion ``; did you mean `N m`?`` for an unknown unit; empty if no unit is similar."""
    if name.lower() in _WORDS:
        return f"; did you mean `{_WORDS[name.lower()]}`?"
    factors = [part for part in re.split(r"[-._]", name) if part]
    product = factors if len(factors) > 1 and all(part in UNITS for part in factors) else _factors(name)
    return f"; did you mean `{' '.join(product)}{factor.removeprefix(name)}`?" if product else did_you_mean(name, UNITS)


def _factors(name: str) -> list[str]:
    """Units in a product without blanks (``Nmm``); empty if the name is not such a product."""
    for length in range(min(len(name) - 1, 3), 0, -1):
        first, rest = name[:length], name[length:]
        if first in UNITS and first != "1":
            others = [rest] if rest in UNITS else _factors(rest)
            if others:
                return [first, *others]
    return []


def _check_dimension(given: Dimension, required: Dimension, message: str) -> None:
    same = [abs(a - b) < 1e-9 for a, b in zip(given, required, strict=True)]
    # radians may be omitted ("N m" for a torsional stiffness)
    if not all(same[:3]) or not (same[3] or given[3] == 0):
        raise ValueError(message)


def unit_in(unit: str, system: str = "SI") -> str:
    """Unit in a unit system for an SI unit: ``"kg/m^3"`` is ``"t/mm^3"`` in ``mm-N-s``."""
    if system == "SI":
        return unit
    return re.sub(r"[A-Za-z]+", lambda match: _NAMES_MM.get(match[0], match[0]), unit)


def with_unit(value: object, unit: str | None, system: str = "SI") -> str:
    """Value of a file as text for messages; a plain number gets its unit."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a section"
    text = f'"{value}"' if isinstance(value, str) else str(value)
    if len(text) > 60:
        text = f"{text[:57]}..."
    plain = isinstance(value, int | float)
    return f"{text} {unit_in(unit, system)}" if unit and plain else text


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Suggestion ``; did you mean `length`?`` for an unknown name; empty if no name is similar."""
    found = [known for known in names if known.lower() == name.lower()]
    found = found or difflib.get_close_matches(name, list(names), n=1, cutoff=0.6)
    return f"; did you mean `{found[0]}`?" if found else ""


@dataclass(frozen=True)
class Unit:
    """Annotation of a float field as a physical quantity: ``Annotated[float, Unit("m")]``.

    The validation context gives the unit system of plain numbers, ``{"units": "mm-N-s"}``; without a context it is SI.

    Parameters
    ----------
    symbol : str
        SI unit.
    power : str
        Name of an earlier field of the model; its value is the exponent of the last factor of the unit.
    """

    symbol: str
    power: str = ""

    def text(self, fields: Mapping[str, Any]) -> str:
        """SI unit for given fields of the same section; empty if the field of the exponent is invalid."""
        if not self.power:
            return self.symbol
        power = fields.get(self.power)
        if isinstance(power, bool) or not isinstance(power, int | float):
            return ""
        return self.symbol if power == 1 else f"{self.symbol}^{power:.12g}"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def read(value: Any, info: core_schema.ValidationInfo) -> float:
            if type(value) is float and not info.context and _in_range(value):  # already in SI
                return value
            system = (info.context or {}).get("units", "SI")
            try:
                return to_si(value, self.text(info.data if self.power else {}), system)
            except ValueError as error:
                raise PydanticCustomError("quantity", "{text}", {"text": str(error)}) from None

        return core_schema.with_info_before_validator_function(read, handler(source))


Length = Annotated[float, Unit("m")]
Mass = Annotated[float, Unit("kg")]
Time = Annotated[float, Unit("s")]
Angle = Annotated[float, Unit("rad")]
Area = Annotated[float, Unit("m^2")]
Force = Annotated[float, Unit("N")]
Moment = Annotated[float, Unit("N m")]
ForceOfLine = Annotated[float, Unit("N/m")]
Stress = Annotated[float, Unit("Pa")]
Density = Annotated[float, Unit("kg/m^3")]
Inertia = Annotated[float, Unit("kg m^2")]
Speed = Annotated[float, Unit("m/s")]
AngularSpeed = Annotated[float, Unit("rad/s")]
Acceleration = Annotated[float, Unit("m/s^2")]
Stiffness = Annotated[float, Unit("N/m")]
AngularStiffness = Annotated[float, Unit("N m/rad")]
StiffnessOfLine = Annotated[float, Unit("N m/rad/m")]
Damping = Annotated[float, Unit("N s/m")]
AngularDamping = Annotated[float, Unit("N m s/rad")]
StopStiffness = Annotated[float, Unit("N m/rad^1.5")]
Temperature = Annotated[float, Unit("K")]
GasConstant = Annotated[float, Unit("J/kg/K")]
MassFlow = Annotated[float, Unit("kg/s")]
TimePerAngle = Annotated[float, Unit("s/rad")]
Number = Annotated[float, Unit("")]


def _not_bool(value: object) -> object:
    if isinstance(value, bool):
        raise PydanticCustomError("int_type", "must be a whole number")
    return value


Count = Annotated[int, BeforeValidator(_not_bool)]
"""Whole number; `true` and `false` are refused."""
