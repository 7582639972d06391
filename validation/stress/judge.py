"""Checks that a result can be correct: numbers, energy balance, momentum, and bodies that pass through each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from typing import Any

import numpy as np

from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.kernels.rotation import rotation_matrix
from fsm.results.quantities import in_motion
from fsm.results.solution import Solution
from validation.sheets.self_contact import intersecting

__all__ = ["TOLD", "Verdict", "free_of_ground", "judge", "momentum_error"]

TOLD = 1e-3
"""Energy error relative to the reference energy above which a run must give a warning."""
_BOOKS = 1e-8
"""Bound of the difference between the recorded energies and their balance."""
_UNIT = 1e-12
"""Bound of the error of the length of a quaternion."""
_LINEAR, _ANGULAR = 1e-7, 5e-2
"""Bounds of the relative change of momenta of a free scene; methods need not conserve angular momentum."""

Verdict = list[str]
"""Faults of a result; empty if there are none."""


def judge(case: Case, solution: Solution) -> Verdict:
    """All faults that the numbers of a result show."""
    found = [*_not_finite(solution)]
    if found:
        return found
    found += [*_unfinished(case, solution), *_books(solution), *_turned(solution)]
    found += _silence(solution, case.solve.energy_abort)
    if case.scene is not None:
        found += [*_momentum(case, solution), *_kinetic(case.scene, solution), *_fallen(case, solution)]
    if case.sheet is not None and case.contact is not None and find_spec("ipctk") is not None:
        count = len(intersecting(solution.shape))
        found += [f"facets pass through each other in {count} saved states"] if count else []
    return found


def _not_finite(solution: Solution) -> Iterator[str]:
    for name in ("time", "q", "u", "travel", "force", "shape", "pair_force", "pair_friction", "pair_slip"):
        if not np.isfinite(getattr(solution, name)).all():
            yield f"{name} is not finite"
    for name, values in solution.energy.items():
        if not np.isfinite(values).all():
            yield f"energy {name} is not finite"
    for path in _odd_numbers(solution.summary, "summary"):
        yield f"{path} is not finite"


def _odd_numbers(value: Any, path: str) -> Iterator[str]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _odd_numbers(item, f"{path}.{key}")
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _odd_numbers(item, path)
    elif isinstance(value, float) and not math.isfinite(value):
        yield path


def _unfinished(case: Case, solution: Solution) -> Iterator[str]:
    """Fault of a run that stopped early without a message."""
    end = case.solve.end_time
    if case.analysis == "vibrate":
        end = case.vibration.duration if case.vibration is not None and case.impact is not None else None
    if end is not None and abs(solution.time[-1] - end) > 1e-9 * end:
        yield f"ends at {solution.time[-1]:.6g} s, not at {end:.6g} s"
    if case.drive and end is None and abs(solution.travel[-1, 0] - case.drive[0].travel) > 1e-9 * case.drive[0].travel:
        yield f"ends at {solution.travel[-1, 0]:.6g} m of travel, not at {case.drive[0].travel:.6g} m"
    if (np.diff(solution.time) <= 0.0).any():
        yield "time does not increase"


def turnover(solution: Solution) -> float:
    """Largest energy that was stored, put in or dissipated, J."""
    names = [name for name in solution.energy if name not in ("error", "work", "dissipated", "numerical")]
    stored = np.sum([solution.energy[name] for name in names], axis=0)
    parts = [stored - stored[0], solution.energy["work"], solution.energy["dissipated"], solution.energy["kinetic"]]
    return float(max(np.abs(part).max() for part in parts))


def _books(solution: Solution) -> Iterator[str]:
    """Check that the recorded energies add up, and that no dissipation is negative."""
    energy, scale = solution.energy, turnover(solution)
    names = [name for name in energy if name not in ("error", "work", "dissipated", "numerical", "kinetic")]
    potential = np.sum([energy[name] for name in names], axis=0)
    size = scale + float(max(np.abs(energy[name]).max() for name in names)) if names else scale
    off = potential + energy["kinetic"] + energy["dissipated"] + energy["numerical"] - energy["work"] - energy["error"]
    if solution.summary["method"] != "static" and not solution.summary["events"]:
        off = np.abs(off - off[0]).max()
        if off > _BOOKS * size:
            yield f"energies do not add up: off by {off:.2g} J of {size:.2g} J"
    back = float(np.diff(energy["dissipated"]).min(initial=0.0))
    if back < -1e-6 * scale:
        yield f"dissipated energy falls by {-back:.2g} J; the reference energy is {scale:.2g} J"


def _silence(solution: Solution, abort: float) -> Iterator[str]:
    """Fault of an open energy balance or of unstable states without a warning; modes have no tolerance that could be
    reduced."""
    summary = solution.summary
    said = " ".join(summary["warnings"])
    # the error includes the round-off of stiff springs, which has a warning of its own
    told = any(words in said for words in ("energy balance", "numerical dissipation", "round-off"))
    if summary["energy_drift"] > TOLD and not told:
        yield f"energy balance off by {summary['energy_drift']:.2g} and nothing said"
    if summary["energy_drift"] > abort and summary["method"] != "modal":
        yield f"energy balance off by {summary['energy_drift']:.2g}, more than energy_abort, and not stopped"
    # unstable states of a snap lie in its event
    unstable = (solution.negative_pivots > 0) & ~in_motion(solution.energy)
    if unstable.any() and "unstable" not in said and "snap" not in said:
        yield "unstable equilibria and nothing said"


def _turned(solution: Solution) -> Iterator[str]:
    """Fault of quaternions without unit length."""
    bodies = len(solution.layout.body_names)
    if solution.layout.dimension == "spatial" and bodies and solution.q.shape[1] == 7 * bodies:
        length = np.linalg.norm(solution.q.reshape(len(solution), -1, 7)[:, :, 3:], axis=2)
        if np.abs(length - 1.0).max() > _UNIT:
            yield f"quaternions off their length by {np.abs(length - 1.0).max():.2g}"


def free_of_ground(case: Case) -> bool:
    """Whether no external force acts on the scene."""
    scene = case.scene
    if scene is None or any(body.held for body in scene.bodies) or case.load or case.obstacle or case.drive:
        return False
    return not any(case.gravity)


def _moving(case: Case, solution: Solution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masses (n,), velocities and positions of the free bodies (records, n, 3)."""
    assert case.scene is not None
    masses = {body.name: body.mass for body in case.scene.bodies}
    n = len(solution.layout.body_names)
    q, u = (values.reshape(len(solution), n, -1) for values in (solution.q, solution.u))
    mass = np.array([masses[name] for name in solution.layout.body_names])
    if solution.layout.dimension == "spatial":
        return mass, u[:, :, :3], q[:, :, :3]
    x, v = np.zeros((len(solution), n, 3)), np.zeros((len(solution), n, 3))
    x[:, :, [0, 2]], v[:, :, [0, 2]] = q[:, :, :2], u[:, :, :2]
    return mass, v, x


def momentum_error(case: Case, solution: Solution) -> tuple[float, float]:
    """Largest change of linear and of angular momentum, relative to the sum of their magnitudes over the bodies."""
    assert case.scene is not None
    mass, v, x = _moving(case, solution)
    linear = np.einsum("i,tij->tj", mass, v)
    size = float(np.einsum("i,ti->t", mass, np.linalg.norm(v, axis=2)).max())
    inertia = {body.name: np.array(body.inertia) for body in case.scene.bodies}
    moments = np.array([inertia[name] for name in solution.layout.body_names])
    q, u = (values.reshape(len(solution), len(mass), -1) for values in (solution.q, solution.u))
    spin = np.zeros_like(v)
    if solution.layout.dimension == "spatial":
        for t in range(len(solution)):
            for i in range(len(mass)):
                spin[t, i] = rotation_matrix(np.ascontiguousarray(q[t, i, 3:])) @ (moments[i] * u[t, i, 3:])
    else:
        spin[:, :, 1] = moments[:, 1] * u[:, :, 2]
    orbit = np.einsum("i,tij->tij", mass, np.cross(x - x[0].mean(axis=0), v))
    angular = (orbit + spin).sum(axis=1)
    turn = float((np.linalg.norm(orbit, axis=2) + np.linalg.norm(spin, axis=2)).sum(axis=1).max())
    return (
        float(np.abs(linear - linear[0]).max() / size) if size else 0.0,
        float(np.abs(angular - angular[0]).max() / turn) if turn else 0.0,
    )


def _momentum(case: Case, solution: Solution) -> Iterator[str]:
    if not free_of_ground(case):
        return
    linear, angular = momentum_error(case, solution)
    if linear > _LINEAR:
        yield f"linear momentum changes by {linear:.2g}"
    if angular > max(_ANGULAR, 20.0 * case.solve.rtol):
        yield f"angular momentum changes by {angular:.2g}"


def _kinetic(scene: Scene, solution: Solution) -> Iterator[str]:
    """Kinetic energy from masses and velocities, computed without kernels."""
    n = len(solution.layout.body_names)
    bodies = {body.name: body for body in scene.bodies}
    u = solution.u.reshape(len(solution), n, -1)
    mass = np.array([bodies[name].mass for name in solution.layout.body_names])
    inertia = np.array([bodies[name].inertia for name in solution.layout.body_names])
    if solution.layout.dimension == "spatial":
        energy = 0.5 * (mass[:, None] * u[:, :, :3] ** 2 + inertia * u[:, :, 3:] ** 2).sum(axis=(1, 2))
    else:
        turning = inertia[:, 1] * u[:, :, 2] ** 2
        energy = 0.5 * (mass[:, None] * u[:, :, :2] ** 2).sum(axis=(1, 2)) + 0.5 * turning.sum(axis=1)
    if solution.summary["method"] != "static" and np.abs(energy - solution.energy["kinetic"]).max() > 1e-10 * energy.max():
        yield "kinetic energy is not that of its velocities"


def _fallen(case: Case, solution: Solution) -> Iterator[str]:
    """Plates that are below a flat table by more than their thickness, without a warning."""
    if not case.obstacle or case.obstacle[0].shape != "plane":
        return
    lowest = float(solution.shape[..., 2].min())
    if lowest < -solution.layout.thickness and not any("penetrate" in text for text in solution.summary["warnings"]):
        yield f"a plate goes {-lowest:.2g} m below the table and nothing is said"
