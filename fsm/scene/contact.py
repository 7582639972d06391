"""Contact and friction sections of a case; the laws themselves are in `fsm.laws`."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model
from fsm.scene.units import Count, Damping, Length, Number, Speed, Unit

__all__ = ["Contact", "Friction"]


class Contact(Model):
    """Normal contact of faces: F = K d^e + STEP(d, 0, 0, ramp, C) d'.

    Attributes
    ----------
    law : "hertz"
    exponent : e, 1.5 for Hertz
    stiffness : N/m^e
        A plain number, or text such as "1e9 N/m^1.5" whose power must be the exponent. Of one whole face
        pressed evenly; shared among its contact points by length, so it does not depend on the mesh.
    damping : N s/m
        C at full ramp, of a whole face.
    ramp : m
        Penetration at which the damping is fully on.
    thickness_in_gap : bool
        Faces touch at half the sum of their thicknesses; false lets the middle surfaces touch.
    points_per_segment : int
        Intervals between the contact points of a segment (Gauss-Lobatto: its ends are points too).
    pairs : pairs of panel numbers of a strip that are watched
        Absent: every panel with the next one.
    """

    law: Literal["hertz"] = "hertz"
    exponent: Annotated[Number, Field(ge=1, le=3)] = 1.5
    stiffness: Annotated[float, Unit("N/m", power="exponent"), Field(gt=0)]
    damping: Annotated[Damping, Field(ge=0)] = 0.0
    ramp: Annotated[Length, Field(gt=0)] = 1e-5
    thickness_in_gap: bool = True
    points_per_segment: Annotated[Count, Field(ge=1, le=5)] = 2
    pairs: tuple[tuple[int, int], ...] | None = None


class Friction(Model):
    """Coulomb friction with a coefficient continuous through zero slip velocity.

    "step": two STEP branches, 0 to mu_static at v_static, then to mu_dynamic at v_dynamic (the ADAMS law);
    "tanh": mu_dynamic tanh(v/v_static). Every such law creeps under a steady tangential load.
    """

    law: Literal["step", "tanh"] = "step"
    mu_static: Annotated[Number, Field(ge=0)] = 0.0
    mu_dynamic: Annotated[Number, Field(ge=0)]
    v_static: Annotated[Speed, Field(gt=0)]
    v_dynamic: Annotated[Speed, Field(gt=0)] | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.law == "step":
            if self.v_dynamic is None:
                raise ValueError(f'law "step" needs v_dynamic, greater than v_static = {self.v_static:g} m/s')
            if self.v_dynamic <= self.v_static:
                raise ValueError(
                    f'law "step" needs v_dynamic greater than v_static; v_dynamic = {self.v_dynamic:g} m/s, '
                    f"v_static = {self.v_static:g} m/s"
                )
            if self.mu_static < self.mu_dynamic:
                raise ValueError(
                    f'law "step" needs mu_static >= mu_dynamic; mu_static = {self.mu_static:g}, '
                    f"mu_dynamic = {self.mu_dynamic:g}"
                )
        return self
