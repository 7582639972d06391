"""Single rigid bodies held by stiff springs: heavy top in space, rotational spring pendulum in the plane and in space."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fsm.solve.outcome.run_io import SavedState
from validation.closed_forms import bodies
from validation.closed_forms.rigid import ADAMS, TOP_ENERGY, TOP_POSITION, TOP_QUATERNION


@cache
def heavy_top() -> list[SavedState]:
    """The top at 0.05, 0.5 and 1 s."""
    return bodies.heavy_top(list(TOP_POSITION))


@pytest.mark.nightly
def test_heavy_top_is_where_it_should_be() -> None:
    for saved, position in zip(heavy_top(), TOP_POSITION.values(), strict=True):
        assert saved.q[:3] == pytest.approx(position, abs=1e-5)
    quaternion = heavy_top()[-1].q[3:]
    assert quaternion * np.sign(quaternion[0]) == pytest.approx(TOP_QUATERNION, abs=1e-5)


@pytest.mark.nightly
def test_heavy_top_keeps_energy_and_norm() -> None:
    for saved in heavy_top():
        assert saved.observation.energy.stored == pytest.approx(TOP_ENERGY, rel=1e-7)
        assert np.linalg.norm(saved.q[3:]) == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize("spatial", [False, True])
def test_rotational_spring_pendulum(spatial: bool) -> None:
    height = bodies.pendulum(spatial, list(ADAMS))
    # the output of ADAMS differs from the exact solution by up to 7.6e-6, at 0.8 s
    assert height == pytest.approx(list(ADAMS.values()), rel=2e-5)
    assert height == pytest.approx(bodies.exact_pendulum(list(ADAMS)), rel=1e-5)
