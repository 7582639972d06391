"""Laws of contact and friction with their parameters."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.contact.anisotropic_friction import add_turn_stiffness, stretch, stretch_efforts
from fsm.laws.friction import FrictionLaw
from fsm.laws.normal import NormalLaw
from fsm.model.bodies.contact_arrays import LawKernels


class NormalForce(NamedTuple):
    """Normal law with its parameters; `exponent` and `speed_floor` (m/s) as in `fsm.case.models.contact.Contact`."""

    law: NormalLaw
    params: np.ndarray
    exponent: float
    speed_floor: float


class FrictionForce(NamedTuple):
    """A friction law with its parameters.

    Attributes
    ----------
    law : FrictionLaw
    params : parameters of the law
    presliding : largest deflection of the bristles, m; infinite without bristles
    across : coefficient across the length of a plate over the coefficient along it, see
        `fsm.interactions.contact.anisotropic_friction`
    """

    law: FrictionLaw
    params: np.ndarray
    presliding: float
    across: float = 1.0


def laws_in_python(normal: NormalForce, friction: FrictionForce | None) -> LawKernels:
    """Laws for contacts in Python, which may be functions of a user; each uses its own parameters."""
    of_normal: Any = normal.law
    effort: Any = None if friction is None else friction.law.effort

    def force(*arguments: Any) -> tuple[np.ndarray, ...]:
        return _floats(of_normal.force(*arguments[:-1], normal.params))

    def energy(*arguments: Any) -> np.ndarray:
        return _floats([of_normal.energy(*arguments[:-1], normal.params)])[0]

    def of_slip(*arguments: Any) -> tuple[np.ndarray, ...]:
        assert friction is not None
        return _floats(effort(*arguments[:-1], friction.params))

    return LawKernels(force, energy, of_slip, of_slip, stretch, stretch_efforts, add_turn_stiffness)


def _floats(values: Any) -> tuple[np.ndarray, ...]:
    return tuple(np.ascontiguousarray(value, dtype=float) for value in values)
