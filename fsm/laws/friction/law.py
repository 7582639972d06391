"""What every friction law is made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

__all__ = ["FrictionDescription", "FrictionLaw"]


class FrictionDescription(Protocol):
    """What a case says of friction; of a law's parameters only those are read that the law has.

    Attributes
    ----------
    mu_static, mu_dynamic : -
    v_static : m/s
        Speed up to which what should stick creeps.
    v_dynamic : m/s
        Speed from which the coefficient is mu_dynamic.
    v_stribeck : m/s
        Speed over which the coefficient falls from mu_static to mu_dynamic.
    viscous : s/m
    presliding : m
        How far bristles bend before they give way.
    bristle_damping : s/m
        None: mu_dynamic/v_stribeck.
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
    """A law of the friction of contact points.

    Attributes
    ----------
    effort : kernel
        ``effort(slip, normal, params) -> effort, by_slip, by_normal``; with `bristle`
        ``effort(slip, mean, normal, deflection, duration, params) -> effort, by_slip, by_mean, by_normal,
        new_deflection``.

        `slip` (m, c), m/s: velocity of slip, one component in the plane, three of a tangent vector in space; `normal`
        (m,), N. `effort` (m, c), N, has the direction of slip: the force on the body that slips is minus it.
        `by_slip` (m, c, c), N s/m, and `by_normal` (m, c) are its derivatives.

        `mean` (m, c), m/s: mean velocity of slip since the last accepted state, `duration` (s) ago, when `deflection`
        (m, c), m, was that of the bristles. `by_mean` (m, c, c), N s/m: the derivative by it.
        `new_deflection` (m, c): the deflection now.
    params : function
        Array of the law's parameters, from a description.
    bristle : bool
        Whether the law remembers a deflection.
    """

    effort: Callable[..., Any]
    params: Callable[[FrictionDescription], np.ndarray]
    bristle: bool
