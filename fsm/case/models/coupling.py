"""Section [[scene.couplings]] of a case: elements on the coordinates of several joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from fsm.case.models.law_keys import LawSection
from fsm.case.schema.model import Model, Name
from fsm.case.schema.units import Angle, AngularDamping, AngularStiffness, Damping, Force, Length, Moment, Stiffness
from fsm.registry import COUPLINGS, AddedLaw

Slack = Literal["below", "above"]
_SLACK = "sense in which it only pulls, like a cable: slack below its taut opening, or above it"


class _Elastic(Model):
    """Parameters that need a stiffness."""

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        given = [key for key in ("damping", "preload", "slack", "backlash", "lag") if getattr(self, key)]
        if getattr(self, "stiffness", None) is None and given:
            raise ValueError(f"`{given[0]}` needs `stiffness`; without a stiffness the coupling is ideal")
        plays = [key for key in given if key in ("slack", "backlash")]
        if len(plays) > 1:
            raise ValueError("give `slack` or `backlash`, not both; `lag` is the play of a coupling with slack")
        if "preload" in given and ("lag" in given or "backlash" in given):
            raise ValueError("a coupling with `preload` has no play; remove `lag` and `backlash`, or `preload`")
        slack, preload = getattr(self, "slack", None), getattr(self, "preload", 0.0)
        if (slack == "below" and preload < 0.0) or (slack == "above" and preload > 0.0):
            sign = "negative" if slack == "above" else "positive"
            raise ValueError(f'`preload` of a cable that is slack "{slack}" is {sign}; or give `lag`, its taut opening')
        return self


class Elasticity(_Elastic):
    """Parameters of the kind "gear" beside its ratio."""

    stiffness: AngularStiffness | None = Field(
        default=None, gt=0, description="stiffness k on the first angle",
        json_schema_extra={"default": "none, the coupling is ideal"},
    )  # fmt: skip
    damping: AngularDamping = Field(default=0.0, ge=0, description="damping on the first angle")
    preload: Moment = Field(default=0.0, description="moment on the opening at the start")
    slack: Slack | None = Field(default=None, description=_SLACK, json_schema_extra={"default": "none"})
    backlash: Angle = Field(default=0.0, ge=0, description="width of the play")
    lag: Angle = Field(default=0.0, description="opening in the middle of the play, or at which a cable becomes taut")


class Gear(Elasticity):
    """Parameters of the kind "gear": e = x_1 - n x_2 of a joint that turns and another one."""

    ratio: float = Field(description="ratio n of the first coordinate to the second, negative for opposite senses")


class Rack(_Elastic):
    """Parameters of the kind "rack": e = x_1 - n x_2 of a joint that slides and another one."""

    ratio: float = Field(
        description="ratio n of the first displacement to the second coordinate; m/rad if the second joint turns"
    )
    stiffness: Stiffness | None = Field(
        default=None, gt=0, description="stiffness k on the first displacement",
        json_schema_extra={"default": "none, the coupling is ideal"},
    )  # fmt: skip
    damping: Damping = Field(default=0.0, ge=0, description="damping on the first displacement")
    preload: Force = Field(default=0.0, description="force on the opening at the start")
    slack: Slack | None = Field(default=None, description=_SLACK, json_schema_extra={"default": "none"})
    backlash: Length = Field(default=0.0, ge=0, description="width of the play")
    lag: Length = Field(default=0.0, description="opening in the middle of the play, or at which a cable becomes taut")


OWN_COUPLINGS = {"gear": AddedLaw(2, Gear, "gear"), "rack": AddedLaw(2, Rack, "rack")}
"""Kinds of the package, with their number of joints as law; `fsm.model.compile.compile_couplings` has their kernels."""


class SceneCoupling(LawSection):
    """Element on the coordinates of joints, measured from the start."""

    chosen_by: ClassVar[str] = "kind"

    name: Name = Field(description="name of the element")
    kind: str = Field(
        description="name of the kind", json_schema_extra={"range": '"gear", "rack", or a kind of an extension'}
    )
    joints: tuple[str, ...] = Field(
        min_length=1,
        description="revolute or prismatic joints, or force elements, whose twists count, in the order of the kind",
        json_schema_extra={"range": "as many as the kind has, all of one sort"},
    )
    parameters: dict[str, Any] | None = Field(default=None, description="parameters of the kind")

    @property
    def ideal(self) -> bool:
        """Whether the opening is locked: a kind of the package without a stiffness."""
        return self.kind in OWN_COUPLINGS and (self.parameters or {}).get("stiffness") is None

    @property
    def ratios(self) -> tuple[float, float]:
        """Factors of both coordinates in the opening of a kind of the package."""
        return 1.0, -float((self.parameters or {})["ratio"])

    @classmethod
    def added(cls, name: object) -> Mapping[str, AddedLaw]:
        """See `LawSection`."""
        return OWN_COUPLINGS | COUPLINGS

    @field_validator("joints")
    @classmethod
    def _count(cls, value: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        known = cls.added(None).get(info.data.get("kind", ""))
        wanted = len(value) if known is None else known.law if isinstance(known.law, int) else known.law.joints
        if len(value) != wanted:
            raise ValueError(f"{len(value)} joints; a coupling of kind {info.data['kind']!r} has {wanted}")
        return value
