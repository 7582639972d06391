"""Solution of a film by a reduced model in its modes, and the error of the reduced model."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline
from scipy.sparse.linalg import splu

from fsm.analyses.analysis import MODAL
from fsm.errors import NotConverged
from fsm.model.nodes.system.reduced import ModalResponse, ReducedModel
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.interface.records import DriveState, Energy, Observation, PairState
from fsm.solve.modal import Modes
from fsm.solve.outcome.energy_balance import EnergyBalance
from fsm.solve.outcome.run_io import AcceptedStep, SavedState, Statistics
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.solve.time.stepwise_run import MEAN_FORCE
from fsm.text.shown_units import shown

_PER_PERIOD = 60.0
"""Steps in a period of the highest mode."""
_CHECKED = 40
"""Number of steps of the full model in the comparison."""
_USELESS = 1.0
"""Error above which the modes do not describe the motion."""
_STRETCHED = 0.1
"""Error of the force from stretching, above which more modes do not reduce the error."""
_FOLLOWS = 8.0
"""Ratio of a frequency to the mean frequency of a motion, above which a mode responds quasi-statically (error 1/16 at
twice this ratio)."""
_ROUNDING = 1e-6
"""Largest increase of the energy that is attributed to round-off, relative to the energy of the modes."""
_NO_PAIRS = PairState(*(np.zeros(0) for _ in range(7)))


def reduced_model(system: AncfSystem, found: Modes, stretch: bool) -> ReducedModel:
    """Reduced model of a film at rest; without `stretch` it is linear."""
    q, _ = system.initial()
    if stretch:
        return ReducedModel.of(system, 0.0, q, found.squared, found.shapes, cubic=True)
    damping = system.linearise(0.0, q, np.zeros(system.nu)).damping.bsr()
    rates = 0.5 * np.einsum("kn,kn->k", found.shapes, (damping @ found.shapes.T).T)
    return ReducedModel(q, found.shapes, found.squared, rates, np.zeros((0,) * 3), np.zeros((0,) * 4))


@dataclass(frozen=True)
class ModelError:
    """Errors of a reduced model relative to the full model; None if the full model needs shorter steps for the
    comparison.

    Attributes
    ----------
    probes, at_impact : largest difference at the probes and at the impact, over the largest displacement there
    stretch : error of the restoring force at the largest displacement (`stretch_left_out`); None if not known
    until : s
        Duration of the comparison; 0 if only the force was compared.
    """

    probes: float | None
    at_impact: float | None
    stretch: float | None
    until: float

    @property
    def largest(self) -> float:
        """Largest of the three errors; infinite if one is not known."""
        return max(math.inf if error is None else error for error in (self.probes, self.at_impact, self.stretch))

    @property
    def text(self) -> str:
        """Description of the errors."""
        force = "the error of the restoring force is not known at the largest displacement (out of range, or wrinkled)"
        if self.stretch is not None:
            force = f"the error of the restoring force is {_part(self.stretch)} at the largest displacement"
        if not self.until:
            return f"{force}; its motion was therefore not compared with the full model"
        if self.probes is None or self.at_impact is None:
            return f"the error of the motion is not known: the full model needs shorter steps than solve.step; {force}"
        motion = f"{_part(self.probes)} at the probes and {_part(self.at_impact)} at the impact"
        return f"the error against the full model is {motion} over the first {shown(self.until, 's')}; {force}"

    @property
    def remedy(self) -> str:
        """Remedy."""
        if self.stretch is None or self.stretch > _STRETCHED:
            few = "if vibration.modes is small, vibration.stretch = true may be accurate enough"
            return f'set vibration.model = "full"; {few}'
        useless = "the modes do not describe this motion: " if self.largest > _USELESS else ""
        return f'{useless}increase vibration.modes, or set vibration.model = "full"'


def _part(error: float) -> str:
    """Text of an error, in percent or, if large, as a multiple."""
    return f"{100.0 * error:.2g} %" if error <= _USELESS else f"{error:.2g} times the whole"


def error_against_full(
    system: AncfSystem,
    model: ReducedModel,
    step: float,
    duration: float,
    probes: Callable[[np.ndarray], np.ndarray],
    at_impact: Callable[[np.ndarray], np.ndarray],
    enough: float = math.inf,
) -> ModelError:
    """Error of the reduced model relative to the full model: of the motion over some steps, and of the restoring force.

    Parameters
    ----------
    step : s
        Step of the full model.
    duration : s
        Duration of the vibration.
    probes, at_impact : functions of a configuration: displacements (n, 3) of all probes, and of the impact
    enough : -
        Error of the force above which the motion is not compared, since steps of a slack film may take minutes.
    """
    until = min(duration, _CHECKED * step)
    stretch = stretch_left_out(system, model, duration)
    if (math.inf if stretch is None else stretch) > enough:
        return ModelError(None, None, stretch, 0.0)
    full: list[tuple[float, np.ndarray, np.ndarray]] = []
    times = [float(t) for t in np.linspace(0.0, until, max(2, round(until / step) + 1))]
    try:
        simulate(
            system, Settings(MEAN_FORCE, 1e-4, until, step=step), times,
            lambda saved: full.append((saved.time, probes(saved.q), at_impact(saved.q))),
        )  # fmt: skip
    except NotConverged:
        return ModelError(None, None, stretch, until)
    response = model.respond(until, step / 8.0, system.loading.forcings)
    if not np.all(np.isfinite(response.amplitude)):  # the motion diverges far outside the range of the cubic terms
        return ModelError(math.inf, math.inf, stretch, until)
    amplitude = CubicHermiteSpline(response.time, response.amplitude, response.rate)
    ours = [model.coordinates(amplitude(t)) for t, _, _ in full]
    errors = []
    for number, place in enumerate((probes, at_impact), start=1):
        theirs = np.array([line[number] for line in full])
        largest = float(np.abs(theirs).max(initial=0.0))
        off = float(np.abs(np.array([place(q) for q in ours]) - theirs).max(initial=0.0))
        errors.append(off / largest if largest else 0.0)
    return ModelError(errors[0], errors[1], stretch, until)


def stretch_left_out(system: AncfSystem, model: ReducedModel, duration: float) -> float | None:
    """Error of the model's restoring force at its largest displacement, which may occur after the pulse.

    The film is displaced by the modes, x = Phi a, and by the quasi-static response of the other coordinates,
    x2 = -K^-1 f2(x, x) without its part in the modes. The error is the difference between the forces of the model and of the
    film, relative to the larger one. The forces are expressed as static deflections in the modes. For a film far stiffer
    than the model the error is about 1:

        |m - f|/max(|m|, |f|),    m = a + (T a a + C a a a)/omega^2,    f = -Phi.(h(x + x2) - h(0))/omega^2

    The result is None if x2 would raise the energy. This occurs far from rest, or where parts of a tension field wrinkle or
    become slack. Such parts have no stiffness in their plane, and the expansion to second order is invalid.

    In the film, modes that are far faster than the motion respond quasi-statically; most of these are in-plane modes. A
    linear model does not include this response. For such modes x2 therefore keeps its part in the modes; otherwise the
    error would be two to three times too large.

    Parameters
    ----------
    duration : s
        Duration of the vibration; the largest displacement is searched up to one period of the lowest mode after the
        last pulse.
    """
    period = 2.0 * math.pi / math.sqrt(float(model.squared.min()))
    end = min(duration, max(system.break_times(), default=0.0) + period)
    a = model.respond(end, _step(system, model, end), system.loading.forcings).amplitude
    if not np.all(np.isfinite(a)):
        return math.inf
    a = a[int(np.argmax(np.sum(a**2, axis=1)))]
    if not np.any(a):
        return 0.0
    q = model.rest
    t = max(system.break_times(), default=0.0)
    at_rest, x = system.force(t, q, None), a @ model.shapes
    second = at_rest - 0.5 * (system.force(t, q + x, None) + system.force(t, q - x, None))
    stiffness = system.linearise(t, q, None).stiffness.symmetric().bsr()
    factors = splu(stiffness.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    stored = 0.5 * float(model.squared @ a**2)
    mean = float(model.squared @ a**2) / float(a @ a)
    own = np.full(len(a), True) if model.cubic.size else model.squared <= _FOLLOWS**2 * mean
    pulled = ((model.shapes[own] @ second) / model.squared[own]) @ model.shapes[own] - factors.solve(second)
    if sum(system.energies(t, q + x + pulled).values()) > sum(system.energies(t, q + x).values()) + _ROUNDING * stored:
        return None
    x = x + pulled
    film = -(model.shapes @ (system.force(t, q + x, None) - at_rest)) / model.squared
    modes = a.copy()
    if model.cubic.size:
        bent = np.einsum("ijk,j,k->i", model.quadratic, a, a)
        bent += np.einsum("ijkl,j,k,l->i", model.cubic, a, a, a, optimize=True)
        modes += bent / model.squared
    return float(np.linalg.norm(modes - film) / max(np.linalg.norm(modes), np.linalg.norm(film)))


def _step(system: AncfSystem, model: ReducedModel, end: float) -> float:
    """Step (s) of the model's motion: a part of the shortest period and of each pulse."""
    highest = math.sqrt(float(model.squared.max())) / (2.0 * math.pi)
    pulses = [t for t in system.break_times() if 0.0 < t <= end]
    return min([1.0 / (_PER_PERIOD * highest), end / 100.0, *(t / 50.0 for t in pulses)])


@dataclass(frozen=True)
class ReducedSolve:
    """Solution of a film in its modes.

    Attributes
    ----------
    system : AncfSystem
        System at rest.
    model : ReducedModel
    """

    system: AncfSystem
    model: ReducedModel

    def go(
        self,
        end: float,
        times: Sequence[float],
        on_save: Callable[[SavedState], None],
        on_step: Callable[[AcceptedStep], None],
        energy_balance: EnergyBalance,
    ) -> Statistics:
        """Solve up to `end` (s) and report states at the requested times.

        The energies are computed from the modal amplitudes and the rest state.

        Raises
        ------
        NotConverged
            The motion left the range of the cubic terms.
        """
        begun = time.perf_counter()
        response = self.model.respond(end, _step(self.system, self.model, end), self.system.loading.forcings)
        size = np.abs(response.amplitude).max(axis=1)
        if not np.all(np.isfinite(size)):
            at = float(response.time[int(np.argmin(np.isfinite(size)))])
            raise NotConverged(
                f"at t = {at:.6g} s: the reduced model left the range of its cubic terms; reduce impact.force, or use "
                'vibration.stretch = false or model = "full"'
            )
        histories = _energies(self.system, self.model, response)
        for stored, kinetic, lost, done in zip(*histories[1:], strict=True):
            energy_balance.dissipated, energy_balance.work = float(lost), float(done)
            energy_balance.balance(float(stored) + energy_balance.start, float(kinetic))
        amplitude = CubicHermiteSpline(response.time, response.amplitude, response.rate)
        potential = self.system.energies(0.0, self.model.rest)
        for t in times:
            on_save(self._saved(t, amplitude, response, histories, potential))
        steps = len(response.time) - 1
        on_step(AcceptedStep(end, *self._state(response.amplitude[-1], response.rate[-1]), steps))
        return Statistics(MODAL, steps=steps, wall_time=time.perf_counter() - begun)

    def _state(self, amplitude: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.model.coordinates(amplitude), rate @ self.model.shapes

    def _saved(
        self,
        t: float,
        amplitude: CubicHermiteSpline,
        response: ModalResponse,
        histories: tuple[np.ndarray, ...],
        at_rest: dict[str, float],
    ) -> SavedState:
        q, u = self._state(amplitude(t), amplitude(t, 1))
        error, stored, kinetic, lost, done = (float(np.interp(t, response.time, values)) for values in histories)
        energy = Energy(kinetic, at_rest | {"film": at_rest.get("film", 0.0) + stored - kinetic}, 0.0, 0.0)
        observed = Observation(DriveState(np.zeros(0), np.zeros(0)), energy, 0.0, _NO_PAIRS)
        return SavedState(t, q, u, observed, lost, done, error, np.zeros((2, 0)))


def _energies(system: AncfSystem, model: ReducedModel, response: ModalResponse) -> tuple[np.ndarray, ...]:
    """Energy balance residual, energy above that at rest, kinetic energy, dissipated energy and work, (n,), J."""
    kinetic = 0.5 * np.sum(response.rate**2, axis=1)
    linear = kinetic + 0.5 * np.sum(model.squared * response.amplitude**2, axis=1)
    stored = model.energy(response) if model.cubic.size else linear
    lost = cumulative_trapezoid(np.sum(2.0 * model.damping * response.rate**2, axis=1), response.time, initial=0.0)
    power = np.zeros(len(response.time))
    for forcing in system.loading.forcings:
        factor = np.array([forcing.time.at(float(t))[0] for t in response.time])
        power += factor * (response.rate @ (model.shapes @ forcing.vector))
    done = cumulative_trapezoid(power, response.time, initial=0.0)
    return stored + lost - done, stored, kinetic, lost, done
