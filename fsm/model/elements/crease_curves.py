"""Moment-angle curves of creases, in series with the bending flexibility of their two half segments."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from fsm.case.models.materials import UNREAD, Crease, FamilyCrease, LinearCrease, SplineCrease
from fsm.errors import CaseError, Fault, fault_at
from fsm.laws.crease import CreaseLaws, MomentCurve, add_flexibility, curve_from_data, join_curves, openings_of
from fsm.laws.crease_hysteresis import hysteresis_stiffness, strength_curve
from fsm.laws.crease_sliders import Sliders, new_sliders

_POINTS = 400
"""Number of openings at which the branches are compared."""
_REVERSAL = 0.02
"""Opening over which a crease passes from one branch to the other, relative to the range of its data."""
_CROSSING = 0.02
"""Tolerance of scatter: amount by which the lower branch may exceed the upper, relative to their largest distance."""


class Hysteresis(NamedTuple):
    """Strength (N m as a function of rad) and stiffness (N m/rad) of the hysteresis of a crease."""

    strength: MomentCurve
    stiffness: float


def curve_of(crease: Crease, flexibility: float = 0.0) -> MomentCurve:
    """Elastic curve of a crease in series with a flexibility (rad/(N m)); with two branches, their mean."""
    branches = _branches(crease, flexibility)
    if len(branches) == 1:
        return branches[0]
    opening = _openings(branches)
    middle = np.mean([[branch(o)[1] for o in opening] for branch in branches], axis=0)
    assert isinstance(crease, SplineCrease)
    return curve_from_data(opening, middle, crease.interpolation)


def hysteresis_of(crease: Crease, flexibility: float = 0.0) -> Hysteresis | None:
    """Hysteresis between the two branches of a tabulated crease; None if there is one branch, or if both are equal.

    With half segments in series (`add_flexibility`) both branches are exact. The transition between the branches takes a
    longer rotation, because the half segments rotate too; `reversal` is the opening of the crease alone.
    """
    branches = _branches(crease, flexibility)
    if len(branches) == 1:
        return None
    assert isinstance(crease, SplineCrease) and crease.angle is not None
    opening = _openings(branches)
    loading, unloading = (np.array([branch(o)[1] for o in opening]) for branch in branches)
    half = 0.5 * (loading - unloading)
    largest = float(half.max())
    if largest <= 0.0 and half.min() == 0.0:
        return None
    if half.min() < -_CROSSING * largest:
        worst = float(np.degrees(opening[int(np.argmin(half))]))
        what = f"the unloading branch lies above the loading branch at {worst:.4g} deg; a crease cannot give energy"
        raise CaseError(Fault("crease.unloading", what))
    strength = strength_curve(opening, np.maximum(half, 0.0))
    reversal = reversal_of(crease)
    rise = 2.0 * largest + reversal * max(0.0, float(np.polyfit(opening, 0.5 * (loading + unloading), 1)[0]))
    return Hysteresis(strength, hysteresis_stiffness(strength, reversal + flexibility * rise))


def reversal_of(crease: Crease) -> float:
    """Opening over which a crease with two branches passes from one to the other after a reversal, rad."""
    assert isinstance(crease, SplineCrease) and crease.angle is not None
    return crease.reversal or _REVERSAL * (crease.angle[-1] - crease.angle[0])


@lru_cache(maxsize=64)
def _branches(crease: Crease, flexibility: float) -> list[MomentCurve]:
    """Loading curve and, if measured, unloading curve; creases of one kind, and cases of a table, share them."""
    if isinstance(crease, LinearCrease):
        k = crease.stiffness
        curves = [curve_from_data(np.array([0.0, 1.0]), np.array([0.0, k]), "pchip")]
    elif isinstance(crease, FamilyCrease):
        raise CaseError(Fault("crease.file", UNREAD))
    else:
        assert isinstance(crease, SplineCrease) and crease.angle is not None and crease.moment is not None
        moments = [crease.moment, *([crease.unloading] if crease.unloading is not None else [])]
        curves = [
            curve_from_data(np.array(crease.angle), crease.scale * np.array(moment), crease.interpolation)
            for moment in moments
        ]
    with fault_at("crease.data"):
        return [add_flexibility(curve, flexibility) for curve in curves]


def _openings(branches: list[MomentCurve]) -> np.ndarray:
    """Openings over the range of all branches."""
    low, high = max(b.knots[0] for b in branches), min(b.knots[-1] for b in branches)
    return np.linspace(low, high, _POINTS)


def sliders_of_laws(
    found: Sequence[Hysteresis | None], curves: CreaseLaws, start: np.ndarray
) -> tuple[Sliders | None, np.ndarray]:
    """Sliders of laws with two branches at the angles `start` (m,), rad, and the folds that have them."""
    known = [number for number, hysteresis in enumerate(found) if hysteresis is not None]
    chosen = np.flatnonzero(np.isin(curves.curve, known))
    if not len(chosen):
        return None, chosen
    which = np.searchsorted(known, curves.curve[chosen])
    laws = [hysteresis for hysteresis in found if hysteresis is not None]
    opening = openings_of(curves, chosen, start)
    stiffness = np.array([law.stiffness for law in laws])[which]
    return new_sliders(opening, stiffness, which.astype(np.int64), join_curves([law.strength for law in laws])), chosen
