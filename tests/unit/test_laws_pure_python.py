"""Laws of contact and friction compiled against the same run by Python itself (NUMBA_DISABLE_JIT=1), in its own process."""

from __future__ import annotations

import numpy as np
import pytest

from fsm.case.models.contact import FRICTION_KEYS, NORMAL_KEYS, Contact, Friction
from fsm.laws.friction import FRICTION_LAWS
from fsm.laws.normal import NORMAL_LAWS
from tests.without_compiler import without_compiler

GIVEN = {
    "damping": 40.0, "ramp": 1e-4, "restitution": 0.4, "mu_static": 0.3, "v_static": 1e-3, "v_dynamic": 1e-2,
    "v_stribeck": 5e-3, "presliding": 1e-5, "viscous": 0.2,
}  # fmt: skip


def evaluate() -> dict[str, tuple[np.ndarray, ...]]:
    """Every law at seeded states in all of its branches."""
    rng = np.random.default_rng(11)
    m = 300
    depth, closing = 10 ** rng.uniform(-6, -2, m), 10 ** rng.uniform(-5, 1, m) * rng.choice([-1.0, 1.0], m)
    depth[:5] = [0.0, -1e-3, 1e-4, 5e-5, 2e-4]
    onset, share = 10 ** rng.uniform(-5, 1, m) * rng.choice([0.0, 1.0], m), rng.uniform(0, 1, m)
    seen = {}
    for name, keys in NORMAL_KEYS.items():
        given = {key: GIVEN[key] for key in (*keys.needed, *keys.optional) if key in GIVEN}
        params = NORMAL_LAWS[name].params(Contact(law=name, stiffness=2e5, **given))
        force = NORMAL_LAWS[name].force(depth, closing, onset, share, params)
        seen[name] = (*force, NORMAL_LAWS[name].energy(depth, share, params))
    for name, keys in FRICTION_KEYS.items():
        given = {key: GIVEN[key] for key in (*keys.needed, *keys.optional) if key in GIVEN}
        law = FRICTION_LAWS[name]
        params = law.params(Friction(law=name, mu_dynamic=0.2, **given))
        for c in (1, 3):
            slip, before = (rng.normal(size=(m, c)) * 10 ** rng.uniform(-6, -1, (m, 1)) for _ in range(2))
            slip[:2] = before[:1] = 0.0
            bent = 1e-5 * rng.uniform(-1, 1, (m, c))
            more = (before, share, bent, 1e-3, params) if law.bristle else (share, params)
            seen[f"{name} {c}"] = law.effort(slip, *more)
    return seen


@pytest.fixture(scope="module")
def pure_python() -> dict[str, tuple[np.ndarray, ...]]:
    return without_compiler(__file__, "fsm.laws.normal.hertz.hertz")


def test_compiled_is_what_python_says(pure_python: dict[str, tuple[np.ndarray, ...]]) -> None:
    compiled = evaluate()
    assert list(compiled) == list(pure_python)
    for name, arrays in compiled.items():
        for a, b in zip(arrays, pure_python[name], strict=True):
            assert np.any(b)
            np.testing.assert_allclose(a, b, rtol=1e-11, atol=1e-14 * np.abs(b).max(), err_msg=name)
