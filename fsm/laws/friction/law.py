"""Protocol of a friction law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np


class FrictionDescription(Protocol):
    """Parameters of friction in a case; each law reads only its own parameters.

    Attributes
    ----------
    mu_static, mu_dynamic : -
    v_static : m/s
        Regularisation speed: a sticking contact creeps below it.
    v_dynamic : m/s
        Speed above which the coefficient is mu_dynamic.
    v_stribeck : m/s
        Speed scale over which the coefficient falls from mu_static to mu_dynamic.
    viscous : s/m
        Viscous part of the coefficient per slip velocity.
    presliding : m
        Bristle deflection at which a contact begins to slide.
    bristle_damping : s/m
        Damping of the bristles; None: mu_dynamic/v_stribeck.
    """

    @property
    def mu_static(self) -> float: ...  # noqa: D102
    @property
    def mu_dynamic(self) -> float: ...  # noqa: D102
    @property
    def v_static(self) -> float: ...  # noqa: D102
    @property
    def v_dynamic(self) -> float | None: ...  # noqa: D102
    @property
    def v_stribeck(self) -> float | None: ...  # noqa: D102
    @property
    def viscous(self) -> float: ...  # noqa: D102
    @property
    def presliding(self) -> float | None: ...  # noqa: D102
    @property
    def bristle_damping(self) -> float | None: ...  # noqa: D102


class FrictionLaw(NamedTuple):
    """Friction law of contact points.

    Attributes
    ----------
    effort : kernel
        ``effort(slip, normal, params) -> effort, by_slip, by_normal``; for a law with bristles
        ``effort(slip, mean, normal, deflection, duration, params) -> effort, by_slip, by_mean, by_normal,
        new_deflection``.

        `slip` (m, c), m/s, is the slip velocity: one component in the plane, a tangent vector of three in space.
        `normal` (m,), N, is the normal force. `effort` (m, c), N, has the direction of slip; the friction force on the
        slipping body is its negative. `by_slip` (m, c, c), N s/m, and `by_normal` (m, c) are its derivatives.

        `mean` (m, c), m/s, is the mean slip velocity since the last accepted state, `duration` (s) ago.
        `deflection` (m, c), m, is the bristle deflection in that state, `new_deflection` (m, c) the present one.
        `by_mean` (m, c, c), N s/m, is the derivative of the effort by `mean`.
    params : function
        Array of the law's parameters from a description.
    bristle : bool
        Whether the law has a bristle deflection as memory.
    """

    effort: Callable[..., Any]
    params: Callable[[FrictionDescription], np.ndarray]
    bristle: bool
