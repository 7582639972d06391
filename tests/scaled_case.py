"""The same dimensionless case in other units of length, mass and time."""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

import numpy as np
from pydantic import BaseModel

import fsm
from fsm.case.loading.toml_text import tables_text
from fsm.case.schema.units import Unit, parse_unit

_KEPT = {"law", "gas_constant", "density", "duration"}
"""Fields that are written also if they have their default: laws, and defaults with a dimension."""


class Factors(NamedTuple):
    """Factors of length, mass and time; powers of four are exact in floating-point numbers, and so are their roots."""

    length: float
    mass: float
    time: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Factors:
        """Random factors: lengths from 1e-6 to 1e3, masses from 1e-12 to 1e12, times from 1e-4 to 1e4."""
        powers = rng.integers((-10, -20, -7), (6, 21, 8))
        return cls(*(4.0 ** powers.astype(float)).tolist())

    def of(self, unit: str) -> float:
        """Factor of a quantity with this unit of SI."""
        _, dimension = parse_unit(unit)
        return math.prod(factor**power for factor, power in zip((*self, 1.0), dimension, strict=True))


def scaled(case: Any, factors: Factors) -> Any:
    """Case (`fsm.load`) whose quantities are multiplied by the factors of their units."""
    tables = _scaled(case.model, type(case.model), (), factors, {})
    tables.pop("expect", None)
    return fsm.load(tables_text(tables | {"units": "SI"}))


def _scaled(value: Any, kind: Any, notes: tuple[Any, ...], factors: Factors, fields: Mapping[str, Any]) -> Any:
    """Value of a field with the annotation `kind` and the further annotations `notes`; `fields` are those of its section."""
    if isinstance(value, BaseModel):
        return _section(value, factors)
    if get_origin(kind) is Annotated:
        kind, *more = get_args(kind)
        return _scaled(value, kind, (*notes, *more), factors, fields)
    units = [note for note in notes if isinstance(note, Unit)]
    if units and isinstance(value, int | float):
        return value * factors.of(units[0].text(fields) or "1")
    if get_origin(kind) in (Union, types.UnionType):
        kind = next((one for one in get_args(kind) if one is not type(None) and _fits(value, one)), Any)
        return value if kind is Any else _scaled(value, kind, notes, factors, fields)
    kinds = get_args(kind)
    if isinstance(value, tuple):
        each = kinds[:1] * len(value) if len(kinds) != len(value) or kinds[-1:] == (...,) else kinds
        return [_scaled(item, one, (), factors, fields) for item, one in zip(value, each, strict=True)]
    if isinstance(value, Mapping):
        return {key: _scaled(item, kinds[-1], (), factors, fields) for key, item in value.items()}
    return value


def _section(section: BaseModel, factors: Factors) -> dict[str, Any]:
    out, fields = {}, type(section).model_fields
    for name, spec in fields.items():
        value = getattr(section, name)
        default = None if spec.is_required() else spec.get_default(call_default_factory=True)
        if value is not None and (name in _KEPT or value != default):
            out[name] = _scaled(value, spec.annotation, tuple(spec.metadata), factors, section.__dict__)
    return out


def _fits(value: Any, kind: Any) -> bool:
    """Whether a value may have an annotation."""
    origin, kinds = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _fits(value, kinds[0])
    if origin in (Union, types.UnionType):
        return any(_fits(value, one) for one in kinds)
    if origin is Literal:
        return value in kinds
    if origin is tuple:
        each = kinds[:1] * len(value) if kinds[-1:] == (...,) else kinds if isinstance(value, tuple) else ()
        return isinstance(value, tuple) and len(each) == len(value) and all(map(_fits, value, each))
    return isinstance(value, (int, float) if kind is float else origin or kind)
