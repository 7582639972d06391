"""Impacts among contacts: selection of the impacts that steps have to resolve, and the step sizes for this.

An undamped impact of the effective mass m at the speed v has the depth d with m v^2/2 = U(d) and takes about 2.94 (Hertz) or
3.14 (linear) times d/v. Contacts of bodies at rest are not impacts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fsm.kernels.jit import kernel

_FIRST_STEP = 0.006
"""Length of the first step of an impact after its onset, relative to the duration of the impact."""
_LEAD_TIME = 0.003
"""Time between the end of the preceding step and the onset of the impact, relative to the duration of the impact."""
_SPEED_CHANGE = 3e-4
"""Limit of the change of speed in the first step of an impact, relative to its initial speed."""
_ENERGY_SHARE = 0.1
"""Energy of an impact of a loose body, relative to the total kinetic energy, above which steps resolve it for any law."""
_REST_TIME = 10.0
"""Time after which a contact counts as resting, relative to the duration of its undamped impact."""
CORNER_WEIGHT = 0.02
"""Approximate weight of a corner in its face."""


class ImpactRules(NamedTuple):
    """Rules of impacts.

    Attributes
    ----------
    mobility : (n_bodies, 3 or 6) array
        Inverse masses and moments of inertia; zero for fixed degrees of freedom.
    loose : (n_bodies,) int array
        1 for bodies that can move and have no force element.
    restitution : 0 or 1
        Whether the normal law has a coefficient of restitution.
    fast : m/s
        Closing speed above which a contact is an impact.
    exponent : -
        Exponent of the normal law.
    steps : -
        Approximate minimum number of steps in an impact.
    """

    mobility: np.ndarray
    loose: np.ndarray
    restitution: int
    fast: float
    exponent: float
    steps: float


@kernel
def effective_mass(bodies: np.ndarray, gradient: np.ndarray, mobility: np.ndarray) -> np.ndarray:
    """Effective mass (m,) along the gap of each contact, other connections neglected, kg.

    `bodies` (m, k) and `gradient` (m, 1 + c, k size) are as in `fsm.model.contact.contact_table.ContactKinematics`.
    """
    out, size = np.empty(bodies.shape[0]), mobility.shape[1]
    for i in range(bodies.shape[0]):
        flexible = 0.0
        for b in range(bodies.shape[1]):
            for k in range(size):
                flexible += gradient[i, 0, b * size + k] ** 2 * mobility[bodies[i, b], k]
        out[i] = 1.0 / max(flexible, 1e-300)
    return out


@kernel
def shared_weight(share: np.ndarray) -> np.ndarray:
    """Weights (m,) of the points of a face that touch together: at least two, except at a corner."""
    out = np.empty(share.shape[0])
    for i in range(share.shape[0]):
        out[i] = min(1.0, 2.0 * share[i])
    return out


@kernel
def _duration(mass: float, speed: float, unit_energy: float, exponent: float) -> float:
    """Duration of an undamped impact, s; `unit_energy` (J) is the energy at the depth 1 m."""
    deepest = (0.5 * mass * speed**2 / unit_energy) ** (1.0 / (1.0 + exponent))
    return 3.0 * deepest / speed


@kernel
def _to_resolve(
    rules: ImpactRules, bodies: np.ndarray, mass: np.ndarray, speed: np.ndarray, rates: np.ndarray
) -> np.ndarray:
    """Mask (m,) of the contacts that are impacts which steps have to resolve.

    With a restitution law these are all contacts that close fast enough. Otherwise they are contacts of loose bodies with a
    considerable part of the total kinetic energy. Segments with force elements yield when they are hit, so their contacts
    are not counted.
    """
    out, some = np.zeros(speed.shape[0], dtype=np.bool_), False
    for i in range(speed.shape[0]):
        out[i] = speed[i] > rules.fast
        if rules.restitution == 0 and out[i]:
            loose = 0
            for b in range(bodies.shape[1]):
                loose += rules.loose[bodies[i, b]]
            out[i] = loose > 0
            some = some or loose > 0
    if not some:
        return out
    kinetic = 0.0
    for i in range(rates.shape[0]):
        for k in range(rates.shape[1]):
            if rules.mobility[i, k] > 0.0:
                kinetic += 0.5 * rates[i, k] ** 2 / rules.mobility[i, k]
    for i in range(speed.shape[0]):
        out[i] = out[i] and 0.5 * mass[i] * speed[i] ** 2 > _ENERGY_SHARE * kinetic
    return out


@kernel
def fraction_before(
    rules: ImpactRules, bodies: np.ndarray, gradient: np.ndarray, gap: np.ndarray, gap_rate: np.ndarray, normal: np.ndarray,
    onset: np.ndarray, unit_energy: np.ndarray, rates_before: np.ndarray, step: float,
) -> float:  # fmt: skip
    """Fraction of a step that ends before its impacts begin; 1 without impacts or if they begin gently.

    A restitution law depends on the closing speed at the onset of the impact. A long step would cause an error of this
    speed.

    Parameters
    ----------
    bodies, gradient, gap, gap_rate : contacts at the end of the step
    normal : (m,) array, N
    onset : (m,) array, m/s
        Closing speed at the start of a contact; zero for contacts that did not exist at the start of the step.
    unit_energy : (m,) array, J
        Energies at the depth 1 m, of `shared_weight`.
    rates_before : (n_bodies, 3 or 6) array
        Rates at the start of the step.
    step : s
    """
    count, size = gap.shape[0], rates_before.shape[1]
    mass = effective_mass(bodies, gradient, rules.mobility)
    start, change, speed = np.zeros(count), np.empty(count), np.empty(count)
    for i in range(count):
        for b in range(bodies.shape[1]):
            for k in range(size):
                start[i] -= gradient[i, 0, b * size + k] * rates_before[bodies[i, b], k]
        end = -gap_rate[i]
        # a contact that is open and has no force at the end of the step had its whole impact within the step
        change[i] = normal[i] * step / mass[i] if normal[i] > 0.0 else start[i] - end
        speed[i] = max(start[i], end + change[i])  # the second value is an estimate of the speed without the contact
    counts, earliest = _to_resolve(rules, bodies, mass, speed, rates_before), np.inf
    for i in range(count):
        if onset[i] != 0.0 or not counts[i] or not change[i] > _SPEED_CHANGE * speed[i]:
            continue
        # the speeds at both ends give the closed distance, and hence the initial gap
        end = -gap_rate[i]
        opened = max(0.0, 0.5 * (start[i] + end) * step + gap[i])
        slowing = np.sqrt(max(0.0, start[i] ** 2 + 2.0 * opened * (end + change[i] - start[i]) / step))
        begins = 2.0 * opened / max(start[i] + slowing, 1e-300)
        earliest = min(earliest, begins - _LEAD_TIME * _duration(mass[i], speed[i], unit_energy[i], rules.exponent))
    if earliest == np.inf:
        return 1.0
    return min(0.9, max(0.05, earliest / step))


@kernel
def longest_step(
    rules: ImpactRules, t: float, bodies: np.ndarray, gradient: np.ndarray, gap: np.ndarray, gap_rate: np.ndarray,
    onset: np.ndarray, began: np.ndarray, unit_energy: np.ndarray, rates: np.ndarray,
) -> float:  # fmt: skip
    """Longest step that resolves present and imminent impacts among nearby contacts, s; arguments as `fraction_before`."""
    count, longest = gap.shape[0], np.inf
    mass, speed = effective_mass(bodies, gradient, rules.mobility), np.empty(count)
    for i in range(count):
        speed[i] = onset[i] if onset[i] > 0.0 else -gap_rate[i]
    counts = _to_resolve(rules, bodies, mass, speed, rates)
    for i in range(count):
        if not counts[i]:
            continue
        duration = _duration(mass[i], speed[i], unit_energy[i], rules.exponent)
        if onset[i] > 0.0:
            if t - began[i] <= _REST_TIME * duration:
                longest = min(longest, duration / rules.steps)
            continue
        begins, lead = max(gap[i], 0.0) / speed[i], _LEAD_TIME * duration
        longest = min(longest, begins - lead if begins > 2.0 * lead else begins + _FIRST_STEP * duration)
    return longest


@kernel
def young_impacts(
    rules: ImpactRules, age: np.ndarray, bodies: np.ndarray, gradient: np.ndarray, onset: np.ndarray,
    unit_energy: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Mask (m,) of contacts that may still be impacts, by their age (s) and initial closing speed (m/s).

    `unit_energy` is that of `CORNER_WEIGHT`. Contacts of bodies that do not move have no duration.
    """
    mass, out = effective_mass(bodies, gradient, rules.mobility), np.zeros(age.shape[0], dtype=np.bool_)
    for i in range(age.shape[0]):
        if not onset[i] > rules.fast:
            continue
        moves = 0.0
        for b in range(bodies.shape[1]):
            for k in range(rules.mobility.shape[1]):
                moves = max(moves, rules.mobility[bodies[i, b], k])
        duration = _duration(mass[i], onset[i], unit_energy[i], rules.exponent) if moves > 0.0 else 0.0
        out[i] = age[i] <= _REST_TIME * duration
    return out
