"""A film solved in its modes: the reduced model's motion handed over as a solver hands over its steps."""

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
from fsm.blocks import BlockMatrix
from fsm.solve.linear import LinearSolver
from fsm.solve.modal import Modes
from fsm.solve.simulate import Ledger, Saved, Statistics, StepEnd
from fsm.system import DriveState, Energy, Observation, PairState

__all__ = ["MODAL", "Basis", "ReducedSolve", "basis_of"]

MODAL = "modal"
"""What the method is called."""
_PER_PERIOD = 60.0
"""Steps in a period of the highest mode."""
_STATIC_SHAPES = 0
"""Static shapes of the impact that are added to the modes."""
_NO_PAIRS = PairState(*(np.zeros(0) for _ in range(7)))


@dataclass(frozen=True)
class Basis:
    """Shapes that a film is solved in, M-orthonormal: its lowest modes, and what they do not hold of the load.

    Attributes
    ----------
    squared : (k,) array, rad^2/s^2
    shapes : (k, nu) array
    missed : -
        Part of the static deflection under the impact, at its own point, that the modes alone do not hold.
    """

    squared: np.ndarray
    shapes: np.ndarray
    missed: float


def basis_of(system: AncfSystem, found: Modes) -> Basis:
    """The modes with the static shapes K^-1 f, K^-1 M K^-1 f, ... of the impact f (Rayleigh and Ritz on both).

    Modes alone hold a load at a point badly: its deflection there is made of very many of them. With these shapes the static
    deflection is exact, and that of inertia about it to the next orders (modal truncation augmentation).
    """
    if not system.loading.forcings:
        return Basis(found.squared, found.shapes, 0.0)
    q, _ = system.initial()
    stiffness = system.linearise(0.0, q, None).stiffness.symmetric()
    pattern = stiffness.pattern
    inertia = BlockMatrix(pattern, system.inertia(q, pattern))
    solver = LinearSolver()
    solver.factorise(stiffness)
    vector = system.loading.forcings[0].vector.copy()
    vector[system.fixed] = 0.0
    shape = deflection = solver.solve(vector)
    basis = list(found.shapes)
    for _ in range(_STATIC_SHAPES):
        for _ in range(2):  # once more for what round-off left
            for one in basis:
                shape = shape - one * float(one @ inertia.times(shape))
        shape = shape / math.sqrt(float(shape @ inertia.times(shape)))
        basis.append(shape)
        shape = solver.solve(inertia.times(shape))
    shapes = np.array(basis)
    projected = np.array([stiffness.times(one) for one in basis]) @ shapes.T
    squared, turn = np.linalg.eigh(0.5 * (projected + projected.T))
    whole = float(vector @ deflection)
    held = float(np.sum((found.shapes @ vector) ** 2 / found.squared))
    return Basis(squared, np.ascontiguousarray(turn.T @ shapes), 1.0 - held / whole)


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
        """
        begun = time.perf_counter()
        highest = math.sqrt(float(self.model.squared.max())) / (2.0 * math.pi)
        pulses = [t for t in self.system.break_times() if 0.0 < t <= end]
        step = min([1.0 / (_PER_PERIOD * highest), end / 100.0, *(t / 50.0 for t in pulses)])
        response = self.model.respond(end, step, self.system.loading.forcings)
        books = _books(self.system, self.model, response)
        for stored, kinetic, lost, done in zip(*books[1:], strict=True):
            ledger.dissipated, ledger.work = float(lost), float(done)
            ledger.balance(float(stored) + ledger.start, float(kinetic))
        amplitude = CubicHermiteSpline(response.time, response.amplitude, response.rate)
        for t in times:
            on_save(self._saved(t, amplitude, response, books, ledger.start))
        steps = len(response.time) - 1
        last = self._state(response.amplitude[-1], response.rate[-1])
        on_step(StepEnd(end, *last, steps))
        return Statistics(MODAL, steps=steps, wall_time=time.perf_counter() - begun)

    def _state(self, amplitude: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.model.coordinates(amplitude), rate @ self.model.shapes

    def _saved(
        self, t: float, amplitude: CubicHermiteSpline, response: Response, books: tuple[np.ndarray, ...], start: float
    ) -> Saved:
        q, u = self._state(amplitude(t), amplitude(t, 1))
        error, stored, kinetic, lost, done = (float(np.interp(t, response.time, values)) for values in books)
        potential = self.system.energies(0.0, self.model.rest)
        potential["film"] = potential.get("film", 0.0) + stored - kinetic
        energy = Energy(kinetic, potential, 0.0, 0.0)
        seen = Observation(DriveState(np.zeros(0), np.zeros(0)), energy, 0.0, _NO_PAIRS)
        return Saved(t, q, u, seen, lost, done, error, np.zeros((2, 0)))


def _books(system: AncfSystem, model: ReducedModel, response: Response) -> tuple[np.ndarray, ...]:
    """Error of the balance, energy above that at rest, kinetic energy, energy dissipated and work done, (n,), J."""
    stored = model.energy(response)
    kinetic = 0.5 * np.sum(response.rate**2, axis=1)
    lost = cumulative_trapezoid(np.sum(2.0 * model.damping * response.rate**2, axis=1), response.time, initial=0.0)
    power = np.zeros(len(response.time))
    for forcing in system.loading.forcings:
        factor = np.array([forcing.time.at(float(t))[0] for t in response.time])
        power += factor * (response.rate @ (model.shapes @ forcing.vector))
    done = cumulative_trapezoid(power, response.time, initial=0.0)
    return stored + lost - done, stored, kinetic, lost, done
