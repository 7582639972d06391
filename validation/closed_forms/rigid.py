"""Checks of single rigid bodies: the heavy top, the rotational spring pendulum."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from validation.closed_forms.bodies import exact_pendulum, heavy_top, pendulum
from validation.gallery.drawing import beside
from validation.gallery.record import Check, Place, against, below

__all__ = ["ADAMS", "TOP_ENERGY", "TOP_POSITION", "TOP_QUATERNION", "heavy", "spring_pendulum"]

TOP_ENERGY = 5435.696790865
TOP_POSITION = {
    0.05: (0.2257411175, 0.9734319843, -0.0383551802),
    0.5: (-0.7024682971, -0.0211651847, -0.7114002577),
    1.0: (0.1733439641, 0.6400885921, -0.7484907911),
}
TOP_QUATERNION = (0.7329439807, -0.2782857193, 0.5318246113, -0.3201761427)
"""Heavy top: energy (J), centre by time (m), attitude at 1 s, by an independent method within 1e-13."""

ADAMS = {
    0.2: -0.1394122,
    0.4: -0.2973064,
    0.6: -0.2587179,
    0.8: -0.1504189,
    1.0: -0.1424453,
    2.0: -0.1867703,
    5.0: -0.1953254,
}
"""Rotational spring pendulum: z of the centre by time, output of ADAMS in Chrono's test set."""


def heavy(place: Place) -> Iterator[Check]:
    """Heavy top: a spinning body on a fixed point."""
    times = [round(0.025 * k, 10) for k in range(1, 41)]
    states = heavy_top(times)
    centre = np.array([s.q[:3] for s in states])
    ours = {axis: (times, centre[:, i]) for i, axis in enumerate("xyz")}
    known = {
        f"{axis} reference": (list(TOP_POSITION), [p[i] for p in TOP_POSITION.values()]) for i, axis in enumerate("xyz")
    }
    picture = beside(place.out / "top.png", ours, known, "time (s)", "centre (m)", size=(6.0, 3.4))
    source = "independent method converged to 1e-13 (validation/references.md)"
    for time, exact in TOP_POSITION.items():
        for axis, value, number in zip("xyz", centre[times.index(time)], exact, strict=True):
            yield against(
                f"{axis} of the centre at {time:g} s",
                "15 kg, 150 rad/s; the fixed point is a stiff spring",
                float(value),
                number,
                source,
                picture,
                atol=1e-5,
                unit="m",
            )
    attitude = states[-1].q[3:] * np.sign(states[-1].q[3])
    for name, value, number in zip(("q0", "q1", "q2", "q3"), attitude, TOP_QUATERNION, strict=True):
        yield against(f"{name} at 1 s", "attitude", float(value), number, source, picture, atol=1e-5)
    energy = [s.observation.energy.stored for s in states]
    worst = max(energy, key=lambda e: abs(e - TOP_ENERGY))
    yield against(
        "energy, where it is off most", "kept by the motion", worst, TOP_ENERGY, source, picture, rtol=1e-7, unit="J"
    )


def spring_pendulum(place: Place) -> Iterator[Check]:
    """Rotational spring pendulum, compared with the output of another program."""
    times = list(ADAMS)
    found = {spatial: pendulum(spatial, times) for spatial in (False, True)}
    curve = np.linspace(0.02, 5.0, 250)
    ours = {"fsm": (curve, pendulum(False, list(curve)))}
    picture = beside(
        place.out / "pendulum.png", ours, {"ADAMS": (times, list(ADAMS.values()))}, "time (s)", "z of the centre (m)"
    )
    for i, (time, number) in enumerate(ADAMS.items()):
        yield against(
            f"z of the centre at {time:g} s",
            "1 kg, 2 m, 200 N m/rad, 10 N m s/rad",
            float(found[False][i]),
            number,
            "output of ADAMS in the test set of Project Chrono",
            picture,
            rtol=2e-5,
            unit="m",
        )
    exact = exact_pendulum(times)
    for spatial, name in ((False, "plane"), (True, "space")):
        off = float(np.abs(found[spatial] / exact - 1).max())
        yield below(
            f"off the exact solution, {name}",
            "largest of these times, relative",
            off,
            1e-5,
            "one degree of freedom, DOP853 at 1e-12",
            picture,
        )
