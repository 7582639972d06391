"""Sections [contact] and [friction] of a case; the laws themselves are in `fsm.laws`."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Final, NamedTuple, Self

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

from fsm.case.models.law_keys import MISSING, LawKeys, LawSection, check_key, refuse
from fsm.case.schema.model import Key
from fsm.case.schema.units import Count, Damping, Length, Number, Speed, Stress, Unit
from fsm.registry import CONTACT_LAWS, FRICTION_LAWS, AddedLaw

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
"""Keys of each law of the normal force; `fsm.laws.normal` defines the names."""

FRICTION_KEYS: Final[dict[str, LawKeys]] = {
    "step": LawKeys(("mu_static", "v_static", "v_dynamic")),
    "tanh": LawKeys(("v_static",)),
    "stribeck": LawKeys(("mu_static", "v_static", "v_stribeck"), ("viscous",)),
    "lugre": LawKeys(("mu_static", "v_stribeck", "presliding"), ("viscous", "bristle_damping")),
}
"""Keys of each friction law; `fsm.laws.friction` defines the names."""

_FROM_MATERIAL: Final = object()


class _Derived(NamedTuple):
    """Stiffness that follows from another section, in SI, N/m^e."""

    number: float


def hertz_stiffness(young: Sequence[float], poisson: Sequence[float], radius: Sequence[float]) -> float:
    """Contact stiffness of two spheres, K = 4/3 E* sqrt(R), N/m^1.5 (Hertz, 1882).

    1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2,   1/R = 1/R1 + 1/R2

    Parameters
    ----------
    young, poisson : Pa and -; one value for both bodies, or two values
    radius : m; one value for a sphere on a flat face, or two values
    """
    compliance = sum((1.0 - poisson[i % len(poisson)] ** 2) / young[i % len(young)] for i in range(2))
    curvature = sum(1.0 / r for r in radius)
    return 4.0 / 3.0 / compliance / curvature**0.5


def with_stiffness(written: Mapping[str, Any], force: float, depth: float) -> Mapping[str, Any]:
    """Section with the stiffness K = F/d^e of a force F (N) at a penetration d (m), with three digits; a section that gives
    a stiffness is unchanged.
    """
    if "stiffness" in written or any(written.get(key) is not None for key in _MATERIAL):
        return written
    exponent = written.get("exponent", 1.0 if written.get("law") == "linear" else 1.5)
    if isinstance(exponent, bool) or not isinstance(exponent, int | float) or not 1.0 <= exponent <= 3.0:
        return {**written, "stiffness": 1.0}  # another message reports a faulty exponent
    stiffness = force / depth**exponent if depth > 0.0 else math.inf
    if 0.0 < stiffness < math.inf:
        stiffness = round(stiffness, 2 - math.floor(math.log10(stiffness)))
    return {**written, "stiffness": _Derived(stiffness)}


def _one_or_two(value: object) -> object:
    if not isinstance(value, list | tuple):
        return (value,)
    if not value:
        refuse("has no value; give one value for both bodies, or two values")
    return value


def _above_zero(value: float) -> float:
    if not 0.0 < value <= 1.0:
        hint = "; a value of 0 needs infinite damping, give 0.01 instead" if value == 0.0 else ""
        refuse(f"must be above 0 and at most 1; it is {value:g}{hint}")
    return value


_Young = Annotated[tuple[Annotated[Stress, Field(gt=0)], ...], Field(max_length=2), BeforeValidator(_one_or_two)]
_Poisson = Annotated[tuple[Annotated[Number, Field(gt=-1, le=0.5)], ...], Field(max_length=2), BeforeValidator(_one_or_two)]
_Radius = Annotated[tuple[Annotated[Length, Field(gt=0)], ...], Field(max_length=2), BeforeValidator(_one_or_two)]
_SlipDamping = Annotated[float, Unit("s/m")]


class Contact(LawSection):
    """Normal contact of faces.

    With the penetration d and its rate d' (positive while closing), the laws are:

    "hertz", "impact": K d^e + STEP(d, 0, 0, ramp, C) d'; "impact" is the ADAMS function and requires `damping`;
    "linear": the same with e = 1, and quadratic up to `ramp`;
    "restitution", "hunt-crossley", "lankarani-nikravesh", "flores": K d^e (1 + h d'/v0), with the closing speed v0 at first
    touch. The factor h follows from the coefficient of restitution, which only "restitution" reproduces exactly.
    """

    laws: ClassVar[Mapping[str, LawKeys]] = NORMAL_KEYS
    law: str = Key(
        'force of a face over its penetration and closing speed; for slow drives "hertz" or "linear", for '
        "impacts a law with `restitution`", default="hertz", shown='"restitution" if `restitution` is given, else "hertz"',
    )  # fmt: skip
    exponent: Number = Key('e; 1 if "linear"', default=1.5, ge=1, le=3)
    young: _Young | None = Key("instead of `stiffness`; one value for both bodies, or [E1, E2]", default=None)
    poisson: _Poisson | None = Key("with `young`; one value for both bodies, or two", default=None)
    radius: _Radius | None = Key("with `young`; one value for a sphere on a flat face, or [R1, R2]", default=None)
    stiffness: Annotated[float, Unit("N/m", power="exponent"), Field(gt=0)] = Key(
        "K of a whole face under uniform pressure, or of a sphere; absent in a strip: K follows from the "
        "material and is practically rigid. As text, the power of its unit must be the exponent",
        shown="needed, except for a strip or with `young`",
    )  # fmt: skip
    damping: Damping = Key("C of a whole face", default=0.0, ge=0)
    ramp: Length = Key(
        'penetration at which the damping, and the stiffness of "linear", reach their full values', default=1e-5, gt=0
    )
    restitution: Annotated[Number, AfterValidator(_above_zero)] | None = Key(
        "c: separation speed over closing speed", default=None, within="0 to 1, 0 excluded"
    )
    speed_floor: Speed = Key("lower bound of v0; slower contacts are pressed contacts and not impacts", default=1e-3, gt=0)
    thickness_in_gap: bool = Key(
        "faces touch at half the sum of their thicknesses; false: middle surfaces touch", default=True
    )
    points_per_segment: Count = Key(
        "number of intervals between the contact points of a segment; its ends are contact points too. Rigid "
        "plate or box: number of cells along each side of a face, with contact points at corners and centres", default=2,
        ge=1, le=5,
    )  # fmt: skip
    pairs: tuple[tuple[int, int], ...] | None = Key(
        "contact pairs of a strip, [[1, 2], [2, 3]]; a `[scene]` has `scene.pairs`", default=None,
        shown="every panel with every other", within="pairs of panel numbers"
    )  # fmt: skip
    resolve_overlap: bool = Key(
        "bodies that overlap at the start are moved apart, lighter bodies farther, with a warning; false: the "
        "case is refused", default=False,
    )  # fmt: skip
    parameters: dict[str, Any] | None = Key("parameters of the law of an extension", default=None)

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """See `LawSection`."""
        return CONTACT_LAWS

    @classmethod
    def completed(cls, written: Mapping[str, Any]) -> dict[str, Any]:
        """Section with its law and its exponent; see `LawSection`."""
        data = dict(written)
        if data.get("restitution") is not None:
            data.setdefault("law", "restitution")
        if data.get("law") == "linear":
            data.setdefault("exponent", 1.0)
        if "stiffness" not in data and any(data.get(key) is not None for key in _MATERIAL):
            data = {**dict.fromkeys(_MATERIAL, MISSING), **data, "stiffness": _FROM_MATERIAL}
        return super().completed(data)

    _used = field_validator("*", mode="before")(check_key(NORMAL_KEYS))

    @field_validator("stiffness", mode="wrap")
    @classmethod
    def _by_formula(cls, value: Any, check: ValidatorFunctionWrapHandler, info: ValidationInfo) -> float:
        parts = [info.data.get(key) for key in _MATERIAL]
        if value is not _FROM_MATERIAL:
            if any(part is not None for part in parts):
                refuse("is given together with `young`, `poisson` or `radius` of Hertz' formula; remove one of the two")
            derived = isinstance(value, _Derived)
            if derived and 0.0 < value.number < math.inf:
                return value.number
            return float(check(value.number if derived else value))
        young, poisson, radius = parts
        if young is None or poisson is None or radius is None:
            return 1.0  # another message reports the faulty value
        if info.data.get("exponent", 1.5) != 1.5:
            exponent = f"the exponent is {info.data['exponent']:g}"
            refuse(f"Hertz' formula requires the exponent 1.5; {exponent}; give `stiffness` instead of `young`")
        return hertz_stiffness(young, poisson, radius)

    @model_validator(mode="after")
    def _is_linear(self) -> Self:
        if self.law == "linear" and self.exponent != 1.0:
            raise ValueError(
                f'law = "linear" requires the exponent 1; it is {self.exponent:g}; remove the exponent, or use law = "hertz"'
            )
        return self

    @model_serializer(mode="wrap")
    def _without_unused(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data = self.used(dump(self))
        if self.young is not None:
            del data["stiffness"]
        return data


class Friction(LawSection):
    """Coulomb friction.

    "step": two STEP branches, from 0 to mu_static at v_static, then to mu_dynamic at v_dynamic (the ADAMS law);
    "tanh": mu_dynamic tanh(v/v_static);
    "stribeck": [mu_dynamic + (mu_static - mu_dynamic) exp(-(v/v_stribeck)^2)] tanh(v/v_static) + viscous v;
    "lugre": elastic bristles that deflect by `presliding` before sliding, and the "stribeck" curve during sliding.
    All laws except "lugre" are regularised: a sticking contact creeps under a tangential load.
    """

    laws: ClassVar[Mapping[str, LawKeys]] = FRICTION_KEYS
    law: str = Key(
        'coefficient of friction over the slip speed; only "lugre" can stick, with the others a resting ' "contact creeps",
        default="step"
    )  # fmt: skip
    mu_static: Number = Key(
        "largest coefficient of friction, at the start of sliding", default=0.0, ge=0, within=">= mu_dynamic"
    )
    mu_dynamic: Number = Key("coefficient of friction of a fast slip", ge=0, within='>= 0; "lugre": > 0')
    v_static: Speed = Key("regularisation speed; a sticking contact creeps below it", default=0.0, gt=0)
    v_dynamic: Annotated[Speed, Field(gt=0)] | None = Key(
        "slip speed at which the coefficient has decreased to mu_dynamic", default=None, within="> v_static"
    )
    v_stribeck: Annotated[Speed, Field(gt=0)] | None = Key(
        "speed at which the coefficient decreases to mu_dynamic", default=None, within="> v_static"
    )
    viscous: _SlipDamping = Key("increase of the coefficient with speed", default=0.0, ge=0)
    presliding: Annotated[Length, Field(gt=0)] | None = Key(
        "deflection of the bristles before sliding; their stiffness is mu_static N/presliding", default=None
    )
    bristle_damping: Annotated[_SlipDamping, Field(ge=0)] | None = Key(
        "damping of the bristles, over N", default=None, shown="mu_dynamic/v_stribeck",
        within="0 to 9.3 mu_dynamic/v_stribeck"
    )  # fmt: skip
    across: Number = Key(
        "in space: coefficient across the length of a panel or plate, over the coefficient along it. The axes "
        "are those of the body with the contact point ([theory](theory.md)). No effect in planar motion", default=1.0, gt=0,
    )  # fmt: skip
    parameters: dict[str, Any] | None = Key("parameters of the law of an extension", default=None)

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """See `LawSection`."""
        return FRICTION_LAWS

    _used = field_validator("*", mode="before")(check_key(FRICTION_KEYS))

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.law not in FRICTION_KEYS:
            return self
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
            raise ValueError('law "lugre" needs mu_dynamic > 0; for a case without friction remove the section')
        assert self.v_stribeck is not None
        # 4/0.4289, where 0.4289 is the maximum of x exp(-x^2); see docs/theory.md
        most = 9.3 * self.mu_dynamic / self.v_stribeck
        if self.bristle_damping is not None and self.bristle_damping > most:
            raise ValueError(
                f"bristle_damping = {self.bristle_damping:g} s/m would generate energy; it must be at most "
                f"9.3 mu_dynamic/v_stribeck = {most:g} s/m"
            )

    @model_serializer(mode="wrap")
    def _without_unused(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return self.used(dump(self))
