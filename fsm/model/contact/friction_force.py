"""Friction of a contact group: a law, its parameters, and the ratio of the coefficients across and along a plate.

e is the unit vector of the second axis of the body that carries the point, and A = 1 + (a - 1) e e^T. The law receives the
slip A v; the friction is A times its effort:

    f = A f_law(A v)        f.v = f_law(A v).(A v) >= 0

The friction therefore dissipates energy if the law does. If the law has a potential of v, the friction has one too. For
a coefficient mu(s) with s = |A v| the friction is f = mu N A^2 v/s. The magnitude is mu N along the first axis and a mu
N along the second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.laws.friction import FrictionLaw


@dataclass(frozen=True)
class FrictionForces:
    """Friction of the contacts of a state.

    Attributes
    ----------
    effort : (m, c) array, N
    by_slip, by_mean : (m, c, c) arrays, N s/m
        Derivatives by the slip and by the mean slip since the last accepted state; `by_mean` is None without bristles.
    by_normal : (m, c) array
    deflection : (m, c) array, m
        Deflection of the bristles in the stretched coordinates of the law.
    by_turn : (m, c, 3) array or None, N
        Derivative with respect to rotations of the body that carries the point, about its axes; None for isotropic friction.
    """

    effort: np.ndarray
    by_slip: np.ndarray
    by_mean: np.ndarray | None
    by_normal: np.ndarray
    deflection: np.ndarray
    by_turn: np.ndarray | None = None


@dataclass(frozen=True)
class FrictionForce:
    """A friction law with its parameters.

    Attributes
    ----------
    law : FrictionLaw
    params : parameters of the law
    presliding : largest deflection of the bristles, m; infinite without bristles
    across : coefficient across the length of a plate over the coefficient along it
    """

    law: FrictionLaw
    params: np.ndarray
    presliding: float
    across: float = 1.0

    def pull(
        self,
        slip: np.ndarray,
        mean: np.ndarray,
        normal: np.ndarray,
        deflection: np.ndarray,
        duration: float,
        axes: np.ndarray | None,
    ) -> FrictionForces:
        """Compute the friction of contacts.

        Parameters
        ----------
        slip, mean : (m, c) arrays, m/s
            Present slip velocity, and the mean since the last accepted state.
        normal : (m,) array, N
        deflection : (m, c) array, m
            Deflection of the bristles in the last accepted state, `duration` (s) earlier.
        axes : (m, 3, 3) array or None
            Axes of the bodies that carry the points, in columns; None for isotropic friction.
        """
        if axes is None:
            return self._of_law(slip, mean, normal, deflection, duration)
        seen = _stretched(slip, axes, self.across), _stretched(mean, axes, self.across)
        pull = self._of_law(*seen, normal, deflection, duration)
        inner = np.zeros_like(axes)
        for slope, way in ((pull.by_slip, slip), (pull.by_mean, mean)):
            if slope is not None:
                inner += np.einsum("mce,mek->mck", slope, self._rotation_derivative(way, axes))
        return FrictionForces(
            _stretched(pull.effort, axes, self.across),
            _stretched_both(pull.by_slip, axes, self.across),
            None if pull.by_mean is None else _stretched_both(pull.by_mean, axes, self.across),
            _stretched(pull.by_normal, axes, self.across),
            pull.deflection,
            self._rotation_derivative(pull.effort, axes) + _stretched_rows(inner, axes, self.across),
        )

    def _of_law(
        self, slip: np.ndarray, mean: np.ndarray, normal: np.ndarray, deflection: np.ndarray, duration: float
    ) -> FrictionForces:
        if not self.law.bristle:
            effort, by_slip, by_normal = self.law.effort(slip, normal, self.params)
            return FrictionForces(effort, by_slip, None, by_normal, np.zeros_like(slip))
        effort, by_slip, by_mean, by_normal, bent = self.law.effort(
            slip, mean, normal, deflection, duration, self.params
        )
        return FrictionForces(effort, by_slip, by_mean, by_normal, bent)

    def _rotation_derivative(self, vectors: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Derivative (m, 3, 3) of A v with respect to rotations about the three axes."""
        first, e, third = axes[:, :, 0], axes[:, :, 1], axes[:, :, 2]
        # de = e3 for a rotation about the first axis, and -e1 for a rotation about the third axis
        change = np.stack([third, np.zeros_like(e), -first], axis=2)
        along, by_change = _dot(e, vectors), np.einsum("mck,mc->mk", change, vectors)
        return (self.across - 1.0) * (change * along[:, None, None] + e[:, :, None] * by_change[:, None, :])


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray((a * b).sum(axis=1))


def _stretched(vectors: np.ndarray, axes: np.ndarray, across: float) -> np.ndarray:
    """Product A v."""
    e = axes[:, :, 1]
    return vectors + (across - 1.0) * e * _dot(e, vectors)[:, None]


def _stretched_rows(matrices: np.ndarray, axes: np.ndarray, across: float) -> np.ndarray:
    """Product A M."""
    e = axes[:, :, 1]
    return matrices + (across - 1.0) * e[:, :, None] * np.einsum("mc,mck->mk", e, matrices)[:, None, :]


def _stretched_both(matrices: np.ndarray, axes: np.ndarray, across: float) -> np.ndarray:
    """Product A M A."""
    rows = _stretched_rows(matrices, axes, across)
    return np.ascontiguousarray(_stretched_rows(rows.transpose(0, 2, 1), axes, across).transpose(0, 2, 1))
