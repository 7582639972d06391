"""Contact and friction sections of a case; the laws themselves are in `fsm.laws`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, Literal, NoReturn, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from fsm.scene.law_keys import LawKeys, check_key, mark_missing, without_unused
from fsm.scene.model import Model
from fsm.scene.units import Count, Damping, Length, Number, Speed, Stress, Unit

__all__ = ["FRICTION_KEYS", "NORMAL_KEYS", "Contact", "Friction", "hertz_stiffness", "with_stiffness"]

_MATERIAL = ("young", "poisson", "radius")
_RESTITUTION = LawKeys(("restitution",), ("exponent", "speed_floor", *_MATERIAL))

NORMAL_KEYS: Final[dict[str, LawKeys]] = {
    "hertz": LawKeys((), ("exponent", "damping", "ramp", *_MATERIAL)),
    "impact": LawKeys(("damping", "ramp"), ("exponent", *_MATERIAL)),
    "linear": LawKeys((), ("exponent", "damping", "ramp")),
    "hunt-crossley": _RESTITUTION,
    "lankarani-nikravesh": _RESTITUTION,
    "flores": _RESTITUTION,
    "restitution": _RESTITUTION,
}
"""Laws of the normal force and the keys that belong to them; the same names as in `fsm.laws.normal`."""

FRICTION_KEYS: Final[dict[str, LawKeys]] = {
    "step": LawKeys(("mu_static", "v_static", "v_dynamic")),
    "tanh": LawKeys(("v_static",)),
    "stribeck": LawKeys(("mu_static", "v_static", "v_stribeck"), ("viscous",)),
    "lugre": LawKeys(("mu_static", "v_stribeck", "presliding"), ("viscous", "bristle_damping")),
}
"""Friction laws and the keys that belong to them; the same names as in `fsm.laws.friction`."""

_FROM_MATERIAL: Final = object()


def hertz_stiffness(young: Sequence[float], poisson: Sequence[float], radius: Sequence[float]) -> float:
    """Stiffness of two spheres, K = 4/3 E* sqrt(R), N/m^1.5 (Hertz).

    1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2,   1/R = 1/R1 + 1/R2

    Parameters
    ----------
    young, poisson : one value of both bodies, or two; Pa and -
    radius : one value of a sphere on a flat face, or two; m
    """
    compliance = sum((1.0 - poisson[i % len(poisson)] ** 2) / young[i % len(young)] for i in range(2))
    curvature = sum(1.0 / r for r in radius)
    return 4.0 / 3.0 / compliance / curvature**0.5


def with_stiffness(written: Mapping[str, Any], force: float, depth: float) -> Mapping[str, Any]:
    """The section with the stiffness K that turns a depth (m) into a force (N), K = F/d^e, if it has none of its own."""
    if "stiffness" in written or any(written.get(key) is not None for key in _MATERIAL):
        return written
    exponent = written.get("exponent", 1.0 if written.get("law") == "linear" else 1.5)
    if isinstance(exponent, bool) or not isinstance(exponent, int | float) or not 1.0 <= exponent <= 3.0:
        return {**written, "stiffness": 1.0}  # the fault is reported for the exponent
    stiffness = force / depth**exponent if depth > 0.0 else math.inf
    return {**written, "stiffness": f"{stiffness:.3g} N/m^{exponent!r}"}


def _refuse(text: str) -> NoReturn:
    raise PydanticCustomError("quantity", "{text}", {"text": text})


def _one_or_two(value: object) -> object:
    if not isinstance(value, list | tuple):
        return (value,)
    if not value:
        _refuse("has no value; give one for both bodies, or two")
    return value


def _above_zero(value: float) -> float:
    if not 0.0 < value <= 1.0:
        hint = "; without any rebound the damping would be infinite, 0.01 comes close" if value == 0.0 else ""
        _refuse(f"must be above 0 and at most 1; it is {value:g}{hint}")
    return value


_Young = Annotated[tuple[Annotated[Stress, Field(gt=0)], ...], Field(max_length=2), BeforeValidator(_one_or_two)]
_Poisson = Annotated[tuple[Annotated[Number, Field(gt=-1, le=0.5)], ...], Field(max_length=2), BeforeValidator(_one_or_two)]
_Radius = Annotated[tuple[Annotated[Length, Field(gt=0)], ...], Field(max_length=2), BeforeValidator(_one_or_two)]
_SlipDamping = Annotated[float, Unit("s/m")]


class Contact(Model):
    """Normal contact of faces. With d the depth and d' its rate, closing positive:

    "hertz", "impact": K d^e + STEP(d, 0, 0, ramp, C) d'; "impact" is the ADAMS function, whose damping must be given;
    "linear": the same with e = 1 and a start that is quadratic up to the ramp;
    "restitution", "hunt-crossley", "lankarani-nikravesh", "flores": K d^e (1 + h d'/v0) with v0 the closing speed at
    first touch and h from the coefficient of restitution; "restitution" delivers exactly that.

    Attributes
    ----------
    law : str
        If absent, "restitution" where a coefficient of restitution is given, and else "hertz".
    exponent : e, 1.5 for Hertz; 1 for "linear"
    young, poisson, radius : Pa, -, m
        Instead of `stiffness`, by Hertz' formula (`hertz_stiffness`). One value of both bodies, or two; a single radius
        is that of a sphere on a flat face.
    stiffness : N/m^e
        Of a strip, absent: from its material, as good as rigid (`fsm.scene.case.contact_scale`). A plain number, or
        text such as "1e9 N/m^1.5" whose power must be the exponent. Of one whole face
        pressed evenly; shared among its contact points by length, so it does not depend on the mesh.
    damping : N s/m
        C at full ramp, of a whole face.
    ramp : m
        Penetration at which the damping is fully on.
    restitution : -
        Speed of parting over speed of approach.
    speed_floor : m/s
        Below this closing speed a contact is a press and not an impact: v0 is not taken as less.
    thickness_in_gap : bool
        Faces touch at half the sum of their thicknesses; false lets the middle surfaces touch.
    points_per_segment : int
        Intervals between the contact points of a segment (Gauss-Lobatto: its ends are points too).
    pairs : pairs of panel numbers of a strip that are watched
        Absent: every panel with every other.
    resolve_overlap : bool
        Bodies that overlap at the start are moved apart; false refuses them.
    """

    law: Literal[
        "hertz", "impact", "linear", "hunt-crossley", "lankarani-nikravesh", "flores", "restitution"
    ] = "hertz"
    exponent: Annotated[Number, Field(ge=1, le=3)] = 1.5
    young: _Young | None = None
    poisson: _Poisson | None = None
    radius: _Radius | None = None
    stiffness: Annotated[float, Unit("N/m", power="exponent"), Field(gt=0)]
    damping: Annotated[Damping, Field(ge=0)] = 0.0
    ramp: Annotated[Length, Field(gt=0)] = 1e-5
    restitution: Annotated[Number, AfterValidator(_above_zero)] | None = None
    speed_floor: Annotated[Speed, Field(gt=0)] = 1e-3
    thickness_in_gap: bool = True
    points_per_segment: Annotated[Count, Field(ge=1, le=5)] = 2
    pairs: tuple[tuple[int, int], ...] | None = None
    resolve_overlap: bool = False

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> dict[str, Any]:
        """See `Model`: the law that is meant, its exponent, and what it lacks."""
        data = dict(written)
        if data.get("restitution") is not None:
            data.setdefault("law", "restitution")
        law = data.get("law", "hertz")
        if law == "linear":
            data.setdefault("exponent", 1.0)
        if "stiffness" not in data and any(data.get(key) is not None for key in _MATERIAL):
            data = mark_missing({**data, "stiffness": _FROM_MATERIAL}, {"": LawKeys(_MATERIAL)}, "")
        return mark_missing(data, NORMAL_KEYS, law)

    _used = field_validator("*", mode="before")(check_key(NORMAL_KEYS))

    @field_validator("stiffness", mode="wrap")
    @classmethod
    def _by_formula(cls, value: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> float:
        parts = [info.data.get(key) for key in _MATERIAL]
        if value is not _FROM_MATERIAL:
            if any(part is not None for part in parts):
                _refuse("give it, or `young`, `poisson` and `radius` for Hertz' formula, not both")
            return float(check(value))
        young, poisson, radius = parts
        if young is None or poisson is None or radius is None:
            return 1.0  # one of them is faulty, which is said where it stands
        if info.data.get("exponent", 1.5) != 1.5:
            _refuse(f"Hertz' formula gives it for the exponent 1.5 only; the exponent is {info.data['exponent']:g}; give it")
        return hertz_stiffness(young, poisson, radius)

    @model_validator(mode="after")
    def _is_linear(self) -> Self:
        if self.law == "linear" and self.exponent != 1.0:
            raise ValueError(f'law = "linear" has the exponent 1; it is {self.exponent:g}; remove it, or take "hertz"')
        return self

    @model_serializer(mode="wrap")
    def _without_unused(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data = without_unused(dump(self), NORMAL_KEYS)
        if self.young is not None:
            del data["stiffness"]
        return data


class Friction(Model):
    """Coulomb friction.

    "step": two STEP branches, 0 to mu_static at v_static, then to mu_dynamic at v_dynamic (the ADAMS law);
    "tanh": mu_dynamic tanh(v/v_static);
    "stribeck": [mu_dynamic + (mu_static - mu_dynamic) exp(-(v/v_stribeck)^2)] tanh(v/v_static) + viscous v;
    "lugre": bristles that bend by `presliding` before they give way, with the curve of "stribeck" as they slide.
    All but "lugre" creep under a steady tangential load.

    Attributes
    ----------
    mu_static, mu_dynamic : -
    v_static, v_dynamic : m/s
        v_static is 0 with a law that has none.
    v_stribeck : m/s
        Speed over which the coefficient falls from static to dynamic.
    viscous : s/m
        Rise of the coefficient with speed.
    presliding : m
        Deflection of the bristles at mu_static.
    bristle_damping : s/m
        Of bending bristles, as a coefficient over a speed; absent means mu_dynamic/v_stribeck.
    across : -
        Coefficients across the length of a panel or plate over those along it, in space; 1 for all directions alike.
    """

    law: Literal["step", "tanh", "stribeck", "lugre"] = "step"
    mu_static: Annotated[Number, Field(ge=0)] = 0.0
    mu_dynamic: Annotated[Number, Field(ge=0)]
    v_static: Annotated[Speed, Field(gt=0)] = 0.0
    v_dynamic: Annotated[Speed, Field(gt=0)] | None = None
    v_stribeck: Annotated[Speed, Field(gt=0)] | None = None
    viscous: Annotated[_SlipDamping, Field(ge=0)] = 0.0
    presliding: Annotated[Length, Field(gt=0)] | None = None
    bristle_damping: Annotated[_SlipDamping, Field(ge=0)] | None = None
    across: Annotated[Number, Field(gt=0)] = 1.0

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> dict[str, Any]:
        """See `Model`: what the law lacks."""
        return mark_missing(written, FRICTION_KEYS, written.get("law", "step"))

    _used = field_validator("*", mode="before")(check_key(FRICTION_KEYS))

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.law != "tanh" and self.mu_static < self.mu_dynamic:
            raise ValueError(
                f'law "{self.law}" needs mu_static >= mu_dynamic; mu_static = {self.mu_static:g}, '
                f"mu_dynamic = {self.mu_dynamic:g}"
            )
        for name, value in (("v_dynamic", self.v_dynamic), ("v_stribeck", self.v_stribeck)):
            if value is not None and value <= self.v_static:
                raise ValueError(
                    f'law "{self.law}" needs {name} greater than v_static; {name} = {value:g} m/s, '
                    f"v_static = {self.v_static:g} m/s"
                )
        if self.law == "lugre":
            self._dissipative()
        return self

    def _dissipative(self) -> None:
        if self.mu_dynamic == 0.0:
            raise ValueError('law "lugre" needs mu_dynamic > 0; for no friction at all remove the section')
        assert self.v_stribeck is not None
        # 4/0.4289, the latter the maximum of x exp(-x^2): docs/theory.md
        most = 9.3 * self.mu_dynamic / self.v_stribeck
        if self.bristle_damping is not None and self.bristle_damping > most:
            raise ValueError(
                f"bristle_damping = {self.bristle_damping:g} s/m would feed energy in; it must be at most "
                f"9.3 mu_dynamic/v_stribeck = {most:g} s/m"
            )

    @model_serializer(mode="wrap")
    def _without_unused(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return without_unused(dump(self), FRICTION_KEYS)
