"""Vibration in a few modes about an equilibrium, with optional cubic stretch at large amplitudes.

The displacement is x = Phi a + x2(a, a). Phi are the modes (M-orthonormal), a their amplitudes, and
x2 = -K^-1 f2(Phi a, Phi a) is the quasi-static response to the quadratic forces of the modes. The response x2 is
mainly the motion of the film within its plane, whose frequencies are much higher. With the elastic force K x + f2(x, x) +
f3(x, x, x) + ... the potential in the modes is

    V(a) = 1/2 sum omega_i^2 a_i^2 + 1/3 sum T_ijk a_i a_j a_k + 1/4 sum C_ijkl a_i a_j a_k a_l

    T_ijk = phi_i.f2(phi_j, phi_k),   C_ijkl = phi_i.f3(phi_j, phi_k, phi_l) - 2 f2(phi_i, phi_j).K^-1 f2(phi_k, phi_l)

f2 and f3 are computed from forces at displaced states by polarisation. The forces of stretch are polynomials of third
degree in the coordinates, so the polarisation is exact. Nonlinear bending is included up to third degree.

A step has three parts (Strang splitting): half the impulse of the nonlinear forces, the exact motion of damped
oscillators, and the other half of the impulse. The load is linear over the step. The step is exact for the linear model
if loads are linear between steps, else of second order. The step has no numerical damping.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu

from fsm.kernels.jit import kernel
from fsm.model.nodes.loading import Forcing
from fsm.solve.interface.system import System


@dataclass(frozen=True, eq=False)
class ModalResponse:
    """Motion in modes.

    Attributes
    ----------
    time : (n,) array, s
    amplitude, rate : (n, k) arrays
        Modal coordinates and their rates.
    """

    time: np.ndarray
    amplitude: np.ndarray
    rate: np.ndarray


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """Modes about an equilibrium; see the module docstring.

    Attributes
    ----------
    rest : (n,) array
        Coordinates of the equilibrium.
    shapes : (k, n) array
        M-orthonormal.
    squared : (k,) array, rad^2/s^2
        omega^2, positive.
    damping : (k,) array, 1/s
        Rates of decay of the amplitude: phi.D phi/2.
    quadratic : (k, k, k) array
        T; zeros for the linear model.
    cubic : (k, k, k, k) array
        C, symmetric in all indices; zeros for the linear model.
    """

    rest: np.ndarray
    shapes: np.ndarray
    squared: np.ndarray
    damping: np.ndarray
    quadratic: np.ndarray
    cubic: np.ndarray

    @classmethod
    def of(
        cls, system: System, t: float, q: np.ndarray, squared: np.ndarray, shapes: np.ndarray, cubic: bool = False,
        amplitude: float = 0.0,
    ) -> ReducedModel:  # fmt: skip
        """The model of a system in some of its modes.

        Parameters
        ----------
        system : System
        t, q : equilibrium
        squared, shapes : fields of `fsm.solve.modal.Modes`, in the same order
        cubic : whether to include large amplitudes
        amplitude : m
            Displacements at which the stretch is evaluated; the value zero means a hundredth of an element.
        """
        if np.any(squared <= 0.0):
            raise ValueError("the equilibrium is not stable: a reduced model needs positive omega^2")
        linear = system.linearise(t, q, np.zeros(system.nu))
        damping = 0.5 * np.einsum("kn,kn->k", shapes, (linear.damping.bsr() @ shapes.T).T)
        k = len(squared)
        terms = cubic_terms(system, t, q, shapes, amplitude) if cubic else (np.zeros((k,) * 3), np.zeros((k,) * 4))
        return cls(q.copy(), shapes, squared, damping, *terms)

    def coordinates(self, amplitude: np.ndarray) -> np.ndarray:
        """Coordinates (..., n) for modal amplitudes (..., k); the second-order response is not included."""
        return np.asarray(self.rest + amplitude @ self.shapes)

    def respond(
        self,
        duration: float,
        step: float,
        forcings: tuple[Forcing, ...] = (),
        amplitude: np.ndarray | None = None,
        rate: np.ndarray | None = None,
    ) -> ModalResponse:
        """Motion at all steps (s) under forcings, from initial modal amplitudes and rates (k,); None means zero."""
        count = math.ceil(duration / step * (1.0 - 1e-9))
        time = np.linspace(0.0, duration, count + 1)
        load = np.zeros((count + 1, len(self.squared)))
        for forcing in forcings:
            factor = np.array([forcing.time.at(t)[0] for t in time])
            load += factor[:, None] * (self.shapes @ forcing.vector)
        zero = np.zeros(len(self.squared))
        h = duration / count
        amplitudes, rates = march(
            h, _transition(self.squared, self.damping, h), self.quadratic, self.cubic, load,
            zero if amplitude is None else np.asarray(amplitude, dtype=float),
            zero if rate is None else np.asarray(rate, dtype=float), bool(np.any(self.cubic) or np.any(self.quadratic)),
        )  # fmt: skip
        return ModalResponse(time, amplitudes, rates)

    def energy(self, response: ModalResponse) -> np.ndarray:
        """Kinetic and elastic energy, (n,), J."""
        a = response.amplitude
        energy = 0.5 * np.sum(response.rate**2 + self.squared * a**2, axis=1)
        energy = energy + np.einsum("ijk,ni,nj,nk->n", self.quadratic, a, a, a) / 3.0
        pairs = np.einsum("ni,nj->nij", a, a)
        return np.asarray(energy + np.einsum("ijkl,nij,nkl->n", self.cubic, pairs, pairs, optimize=True) / 4.0)


def cubic_terms(
    system: System, t: float, q: np.ndarray, shapes: np.ndarray, amplitude: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """T (k, k, k) and C (k, k, k, k) of `ReducedModel`; k (k + 1) (k + 2)/6 force evaluations and a few more."""
    amplitude = amplitude or 0.01 * system.scales().length
    size = np.abs(shapes / system.scales().increment).max(axis=1) * system.scales().length / amplitude
    x = shapes / size[:, None]
    k = len(x)
    stiffness = system.linearise(t, q, None).stiffness.symmetric().bsr()
    at_rest = system.force(t, q, None)

    def parts(dx: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """f2(dx, dx) and f3(dx, dx, dx)."""
        ahead, behind = system.force(t, q + dx, None), system.force(t, q - dx, None)
        return -0.5 * (ahead + behind) + at_rest, -0.5 * (ahead - behind) - stiffness @ dx

    single = [parts(x[i]) for i in range(k)]
    double = {(i, j): parts(x[i] + x[j]) for i in range(k) for j in range(i, k)}
    square = np.zeros((k, k, len(q)))
    for (i, j), (second, _) in double.items():
        square[i, j] = square[j, i] = 0.5 * (second - single[i][0] - single[j][0])
    quadratic = np.einsum("in,jkn->ijk", x, square)
    factors = splu(stiffness.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    moved = np.stack([[factors.solve(square[i, j]) for j in range(k)] for i in range(k)])
    pulled = np.einsum("ijn,kln->ijkl", square, moved, optimize=True)
    cubic = -2.0 / 3.0 * (pulled + pulled.transpose(0, 2, 1, 3) + pulled.transpose(0, 3, 2, 1))
    for i in range(k):
        for j in range(i, k):
            for m in range(j, k):
                whole = parts(x[i] + x[j] + x[m])[1]
                pairs = double[i, j][1] + double[i, m][1] + double[j, m][1]
                third = (whole - pairs + single[i][1] + single[j][1] + single[m][1]) / 6.0
                along = x @ third
                for a, b, c in {(i, j, m), (i, m, j), (j, i, m), (j, m, i), (m, i, j), (m, j, i)}:
                    cubic[:, a, b, c] += along
    scale3 = size[:, None, None] * size[None, :, None] * size[None, None, :]
    return quadratic * scale3, cubic * scale3[..., None] * size


def _transition(squared: np.ndarray, damping: np.ndarray, h: float) -> np.ndarray:
    """Motion of damped oscillators after a step h, (6, k); the rows are:

    the motion from a = 1 and from v = 1; the rates of both motions; the motion under the load 1 and under the load s/h. The
    rate under the load 1 is the motion from v = 1. The rate under the load s/h is the motion under the load 1, divided by h.
    """
    cosine, sine = _faded(squared, damping, h)
    by_a, by_v = cosine + damping * sine, sine
    rate_a, rate_v = -squared * by_v, cosine - damping * sine
    by_load = (1.0 - by_a) / squared
    by_slope = (h - 2.0 * damping * by_load - by_v) / squared / h
    return np.ascontiguousarray(np.stack([by_a, by_v, rate_a, rate_v, by_load, by_slope]))


def _faded(squared: np.ndarray, damping: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """exp(-d h) cos(w h) and exp(-d h) sin(w h)/w with w^2 = squared - d^2, (k,) each; of overdamped modes cosh and sinh."""
    omega = np.sqrt(np.abs(squared - damping**2))
    over = damping**2 > squared
    size = np.where(omega > 0.0, omega, 1.0)
    fade = np.exp(-damping * h)
    # the slower of the two rates d - w and d + w is squared/(d + w), computed without cancellation
    slow = np.exp(-np.where(over, squared / (damping + size), 0.0) * h)
    drop = -np.expm1(-2.0 * np.where(over, omega, 0.0) * h)
    cosine = np.where(over, slow * (1.0 - 0.5 * drop), fade * np.cos(omega * h))
    sine = np.where(over, 0.5 * slow * drop / size, fade * np.sin(omega * h) / size)
    return cosine, np.where(omega > 0.0, sine, fade * h)


@kernel
def march(
    h: float, transition: np.ndarray, quadratic: np.ndarray, cubic: np.ndarray, load: np.ndarray, a0: np.ndarray,
    v0: np.ndarray, nonlinear: bool,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Amplitudes and rates (n, k) at all steps. load (n, k) is linear between steps; `_transition` gives `transition`."""
    count, k = load.shape
    amplitude, rate = np.empty((count, k)), np.empty((count, k))
    a, v, kick = a0.copy(), v0.copy(), np.zeros(k)
    amplitude[0], rate[0] = a, v
    if nonlinear:
        nonlinear_force(quadratic, cubic, a, kick)
    for n in range(1, count):
        for i in range(k):
            a_i, v_i = a[i], v[i] + 0.5 * h * kick[i]
            change = load[n, i] - load[n - 1, i]
            by_a, by_v, rate_a, rate_v = transition[0, i], transition[1, i], transition[2, i], transition[3, i]
            by_load, by_slope = transition[4, i], transition[5, i]
            a[i] = by_a * a_i + by_v * v_i + by_load * load[n - 1, i] + by_slope * change
            v[i] = rate_a * a_i + rate_v * v_i + by_v * load[n - 1, i] + by_load / h * change
        if nonlinear:
            nonlinear_force(quadratic, cubic, a, kick)
            for i in range(k):
                v[i] += 0.5 * h * kick[i]
        amplitude[n], rate[n] = a, v
    return amplitude, rate


@kernel
def nonlinear_force(quadratic: np.ndarray, cubic: np.ndarray, a: np.ndarray, force: np.ndarray) -> None:
    """-dV/da of the cubic and quartic parts of the potential, into `force` (k,)."""
    k = a.shape[0]
    for i in range(k):
        total = 0.0
        for j in range(k):
            for m in range(k):
                inner = quadratic[i, j, m]
                for n in range(k):
                    inner += cubic[i, j, m, n] * a[n]
                total += inner * a[j] * a[m]
        force[i] = -total
