"""Parameters of the kind "gear" of `[[scene.couplings]]`."""

from __future__ import annotations

from pydantic import Field

from fsm.case.schema.model import Model
from fsm.case.schema.units import AngularDamping, AngularStiffness


class Gear(Model):
    """Spring and damper between the angles of two joints, U = k/2 (phi_1 - n phi_2)^2."""

    ratio: float = Field(description="ratio n of the first angle to the second; negative if they turn opposite ways")
    stiffness: AngularStiffness = Field(gt=0, description="stiffness k on the first angle")
    damping: AngularDamping = Field(default=0.0, ge=0, description="damping on the first angle")
