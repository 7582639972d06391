"""The loss of a one-sided spring and damper over a step, against quadrature."""

from __future__ import annotations

from itertools import pairwise

import pytest
from scipy.integrate import quad

from fsm.laws.one_sided import mean_loss, one_sided


@pytest.mark.parametrize("rebound", [0.0, 0.3])
@pytest.mark.parametrize("ends", [(-0.2, 0.5), (0.5, -0.2), (0.5, 0.05), (0.1, 0.4), (-0.3, -0.1), (0.2, 0.2)])
@pytest.mark.parametrize("damping", [0.0, 0.7])
def test_the_mean_loss_of_a_step(ends: tuple[float, float], damping: float, rebound: float) -> None:
    """Steps in which the bodies touch, part, or the effort would pull; the rate is constant."""
    (begin, end), stiffness = ends, 3.0
    rate = (end - begin) / 0.4

    def power(part: float) -> float:
        at = begin + part * (end - begin)
        return one_sided(at, rate, stiffness, damping + stiffness * rebound * max(at, 0.0))[4]

    apart = -damping * rate / (stiffness * (1.0 + rebound * rate))
    kinks = [part for at in (0.0, apart) if begin != end and 0.0 < (part := (at - begin) / (end - begin)) < 1.0]
    exact = sum(quad(power, *pair, epsabs=1e-13)[0] for pair in pairwise([0.0, *sorted(kinks), 1.0]))
    assert mean_loss(begin, end, rate, stiffness, damping, rebound) == pytest.approx(exact, rel=1e-9, abs=1e-13)
