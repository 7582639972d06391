"""A film solved in its modes: the reduced model's motion handed over as a solver does, and how good it is."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline

from fsm.ancf.reduced import ReducedModel, Response
from fsm.ancf.system import AncfSystem
from fsm.errors import NotConverged
from fsm.solve.handed_over import Saved, Statistics, StepEnd
from fsm.solve.ledger import Ledger
from fsm.solve.modal import Modes
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.system import DriveState, Energy, Observation, PairState

__all__ = ["CHECKED", "MODAL", "ReducedSolve", "error_against_full", "reduced_model"]

MODAL = "modal"
"""What the method is called."""
_PER_PERIOD = 60.0
"""Steps in a period of the highest mode."""
CHECKED = 40
"""Steps of the full model that the reduced one is compared with."""
_NO_PAIRS = PairState(*(np.zeros(0) for _ in range(7)))


def reduced_model(system: AncfSystem, found: Modes, stretch: bool) -> ReducedModel:
    """The model of a film at rest in its modes; without stretch, linear, with terms of the third degree for none of them."""
    q, _ = system.initial()
    if stretch:
        return ReducedModel.of(system, 0.0, q, found.squared, found.shapes, cubic=True)
    damping = system.linearise(0.0, q, np.zeros(system.nu)).damping.bsr()
    rates = 0.5 * np.einsum("kn,kn->k", found.shapes, (damping @ found.shapes.T).T)
    return ReducedModel(q, found.shapes, found.squared, rates, np.zeros((0,) * 3), np.zeros((0,) * 4))


def error_against_full(
    system: AncfSystem, model: ReducedModel, step: float, until: float, probe: Callable[[np.ndarray], np.ndarray]
) -> float:
    """Largest difference of the probes between the reduced and the full model over the largest of the full one.

    Parameters
    ----------
    step : s
        Of the full model.
    until : s
        Compared so long.
    probe : displacement of all probes at a configuration

    Raises
    ------
    NotConverged
        The full model cannot be solved with these steps.
    """
    full: list[tuple[float, np.ndarray]] = []
    times = [float(t) for t in np.linspace(0.0, until, max(2, round(until / step) + 1))]
    simulate(
        system, Settings("generalized-alpha", 1e-4, until, step=step), times,
        lambda saved: full.append((saved.time, probe(saved.q))),
    )  # fmt: skip
    response = model.respond(until, step / 8.0, system.loading.forcings)
    amplitude = CubicHermiteSpline(response.time, response.amplitude, response.rate)
    ours = np.array([probe(model.coordinates(amplitude(t))) for t, _ in full])
    theirs = np.array([values for _, values in full])
    largest = float(np.abs(theirs).max(initial=0.0))
    return float(np.abs(ours - theirs).max(initial=0.0)) / largest if largest else 0.0


@dataclass(frozen=True)
class ReducedSolve:
    """The solve of a film in its modes.

    Attributes
    ----------
    system : AncfSystem
        At rest at the start.
    model : ReducedModel
    """

    system: AncfSystem
    model: ReducedModel

    def go(
        self,
        end: float,
        times: Sequence[float],
        on_save: Callable[[Saved], None],
        on_step: Callable[[StepEnd], None],
        ledger: Ledger,
    ) -> Statistics:
        """Solve up to `end` (s) and hand over the states at the times that are wanted.

        Energies are those of the model: of its modes, and of the rest that they are about.

        Raises
        ------
        NotConverged
            The motion left the range in which terms of the third degree mean anything.
        """
        begun = time.perf_counter()
        highest = math.sqrt(float(self.model.squared.max())) / (2.0 * math.pi)
        pulses = [t for t in self.system.break_times() if 0.0 < t <= end]
        step = min([1.0 / (_PER_PERIOD * highest), end / 100.0, *(t / 50.0 for t in pulses)])
        response = self.model.respond(end, step, self.system.loading.forcings)
        size = np.abs(response.amplitude).max(axis=1)
        if not np.all(np.isfinite(size)):
            at = float(response.time[int(np.argmin(np.isfinite(size)))])
            raise NotConverged(
                f"at t = {at:.6g} s: the reduced model left the range of its cubic terms; strike more softly, or take "
                'vibration.stretch = false or model = "full"'
            )
        books = _books(self.system, self.model, response)
        for stored, kinetic, lost, done in zip(*books[1:], strict=True):
            ledger.dissipated, ledger.work = float(lost), float(done)
            ledger.balance(float(stored) + ledger.start, float(kinetic))
        amplitude = CubicHermiteSpline(response.time, response.amplitude, response.rate)
        potential = self.system.energies(0.0, self.model.rest)
        for t in times:
            on_save(self._saved(t, amplitude, response, books, potential))
        steps = len(response.time) - 1
        on_step(StepEnd(end, *self._state(response.amplitude[-1], response.rate[-1]), steps))
        return Statistics(MODAL, steps=steps, wall_time=time.perf_counter() - begun)

    def _state(self, amplitude: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.model.coordinates(amplitude), rate @ self.model.shapes

    def _saved(
        self,
        t: float,
        amplitude: CubicHermiteSpline,
        response: Response,
        books: tuple[np.ndarray, ...],
        at_rest: dict[str, float],
    ) -> Saved:
        q, u = self._state(amplitude(t), amplitude(t, 1))
        error, stored, kinetic, lost, done = (float(np.interp(t, response.time, values)) for values in books)
        energy = Energy(kinetic, at_rest | {"film": at_rest.get("film", 0.0) + stored - kinetic}, 0.0, 0.0)
        seen = Observation(DriveState(np.zeros(0), np.zeros(0)), energy, 0.0, _NO_PAIRS)
        return Saved(t, q, u, seen, lost, done, error, np.zeros((2, 0)))


def _books(system: AncfSystem, model: ReducedModel, response: Response) -> tuple[np.ndarray, ...]:
    """Error of the balance, energy above that at rest, kinetic energy, energy dissipated and work done, (n,), J."""
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
