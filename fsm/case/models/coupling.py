"""Section [[scene.couplings]] of a case: elements on the coordinates of several joints."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import ValidationInfo, field_validator, model_validator

from fsm.case.models.law_keys import LawSection
from fsm.case.schema.model import Key, Model, Name
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

    stiffness: AngularStiffness | None = Key(
        "stiffness k on the first angle", default=None, gt=0, shown="none, the coupling is ideal"
    )
    damping: AngularDamping = Key("damping on the first angle", default=0.0, ge=0)
    preload: Moment = Key("moment on the opening at the start", default=0.0)
    slack: Slack | None = Key(_SLACK, default=None, shown="none")
    backlash: Angle = Key("width of the play", default=0.0, ge=0)
    lag: Angle = Key("opening in the middle of the play, or at which a cable becomes taut", default=0.0)


class Gear(Elasticity):
    """Parameters of the kind "gear": e = x_1 - n x_2 of a joint that turns and another one."""

    ratio: float = Key("ratio n of the first coordinate to the second, negative for opposite senses")


class Rack(_Elastic):
    """Parameters of the kind "rack": e = x_1 - n x_2 of a joint that slides and another one."""

    ratio: float = Key("ratio n of the first displacement to the second coordinate; m/rad if the second joint turns")
    stiffness: Stiffness | None = Key(
        "stiffness k on the first displacement", default=None, gt=0, shown="none, the coupling is ideal"
    )
    damping: Damping = Key("damping on the first displacement", default=0.0, ge=0)
    preload: Force = Key("force on the opening at the start", default=0.0)
    slack: Slack | None = Key(_SLACK, default=None, shown="none")
    backlash: Length = Key("width of the play", default=0.0, ge=0)
    lag: Length = Key("opening in the middle of the play, or at which a cable becomes taut", default=0.0)


OWN_COUPLINGS = {"gear": AddedLaw(2, Gear, "gear"), "rack": AddedLaw(2, Rack, "rack")}
"""Kinds of the package, with their number of joints as law; `fsm.model.compile.compile_couplings` has their kernels."""


class SceneCoupling(LawSection):
    """Element on the coordinates of joints, measured from the start."""

    chosen_by: ClassVar[str] = "kind"

    name: Name = Key("name of the element")
    kind: str = Key("name of the kind", within='"gear", "rack", or a kind of an extension')
    joints: tuple[str, ...] = Key(
        "revolute or prismatic joints, or force elements, whose twists count, in the order of the kind", min_length=1,
        within="as many as the kind has, all of one sort"
    )  # fmt: skip
    parameters: dict[str, Any] | None = Key("parameters of the kind", default=None)

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
