"""State, rules and records of a quasi-static path, whose steps `fsm.solve.stepping.path` takes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.block_equations import UNKNOWN as UNKNOWN
from fsm.kernels.records import record

(
    ACCEPTED, NEWTON, FAR, UNSTABLE, SINGULAR, INERTIA, CROSSED, HEAD_ON, COARSE, LIMIT, APART, SLOWED, LACKS, DOUBTFUL,
    UNABLE, EVENT, RELEASED,
) = range(17)  # fmt: skip
"""Outcomes of a step: acceptance, and the reasons for a rejection (`fsm.solve.statics.path_steps.Reason`).

APART: a joint has opened too far. SLOWED is an unstable state that only dampers hold. LACKS: two bodies have met whose block
the pattern lacks. DOUBTFUL: there are negative pivots, or their signs are not certain; the caller judges the stability
(`counts[JUDGED]`). UNABLE: only the methods in Python can take this step. EVENT: the step passes
an event, such as a latch that closes. RELEASED (of `counts[JUDGED]` alone): the state is unstable at rest, and no damper
holds it."""

TIME, BEFORE, SIZE, COARSE_AT, COARSE_STEP, COARSE_ERROR, REACTION, FORCE_ROUND_OFF, FOUND_AT = range(9)
"""Indices of `Path.numbers`: time and the time before (s), size of the next step (s); time (s), size (s) and relative energy
error of the last step whose energy balance was checked; largest reaction so far and round-off of the forces (N); time of the
state in `Path.found` (s)."""
(
    KNOWN, STEPS, REJECTED, ITERATIONS, EVALUATIONS, FACTORISATIONS, AT_EVENT, LAST_ITERATIONS, EARLIER, RESTING, JUDGED,
) = range(11)  # fmt: skip
"""Indices of `Path.counts`: known states of the extrapolation; accepted and rejected steps; iterations, evaluations and
factorisations; whether the last step ends at an event (0 or 1); iterations of the last step; whether `earlier` and
`resting` belong to this path (0 or 1); outcome plus one of the judgement of the state in `Path.found`, ACCEPTED, UNSTABLE,
SLOWED or RELEASED, or zero."""
(
    PASSED, NEGATIVE, NEGATIVE_AT_REST, LOST, LOADS, KEPT_LOSS, CONTACT, GRAVITY, PANELS, CREASES, KINETIC, INPUT, DRIVEN,
    STORED, LARGEST, OPENING, BARS, HINGES, FILM, PATCH, CABLE, BEAM, GAS, PART, DRIVES,
) = range(25)  # fmt: skip
"""Indices of a record of a state. PASSED is 1 if sides of a contact have passed through each other. NEGATIVE is the number
of negative pivots of the last matrix of the step, NEGATIVE_AT_REST that of the symmetric part of the stiffness at rest; both
may be `UNKNOWN`. LOST, LOADS and INPUT are the powers of dampers and friction, of loads, and of loads and drives (W);
KEPT_LOSS is the part of LOST whose forces also act at rest. Energies of contacts, weights, panels and creases, of the
motion, of driven bodies, and the sum of all potential energies (J). LARGEST is the largest reaction (N), OPENING the largest
separation of the sides of a joint (m). From BARS on: energies of the other kinds of elements and of gas (J). PART is the
part of the step up to its first event, 1 at its end, or zero without one. Travels, then forces of all drives follow, and
seven values of each contact pair: the rows PAIR_FORCE to PAIR_GAP."""
PAIR_FORCE, PAIR_AREA, PAIR_FRICTION, PAIR_CARRIED, PAIR_SLIDING, PAIR_DAMPING, PAIR_GAP = range(7)
"""Rows of the values of contact pairs in a record: normal force and magnitude of friction (N), area (m^2), sum of normal
force times slip speed, powers of friction and damping (W), and gap (m)."""
AT, MOVING_ON, BALANCE = range(3)
"""Indices of a row that describes a state: time (s), 1 for an unstable state, and numbers of the energy balance; then its
record, `Path.pair_energy`, and its configuration."""

KEPT = 3
"""Number of stored states of the extrapolation: three for a parabola."""


@record
class PathRules(NamedTuple):
    """Tolerances and scales.

    Attributes
    ----------
    tolerance : -
        Largest residual relative to the largest reaction.
    reach, max_iterations, mixed, span, force_scale : as in `NewtonRules`
    rtol, aim, far : -
        Relative tolerance, desired and largest correction of a prediction.
    first_step, max_step, smallest : s
    slow : J
        Kinetic energy below which inertia is negligible in any case.
    length, extent, widest : m
        Sizes of a segment and of the structure, and largest opening of a joint.
    force_limit : N
    abort, judged_from : - and s
        Energy error that stops the path, and the time from which it does.
    rate_dependent, fixed_pattern : bool, see `System`
    sticking : s
        Time for which contacts that stick may hold an unstable state.
    trial : (nu,) array, see `fsm.solve.stepping.accuracy`
    """

    tolerance: float
    reach: float
    max_iterations: int
    mixed: bool
    span: np.ndarray
    force_scale: np.ndarray
    rtol: float
    aim: float
    far: float
    first_step: float
    max_step: float
    smallest: float
    slow: float
    length: float
    extent: float
    widest: float
    force_limit: float
    abort: float
    judged_from: float
    rate_dependent: bool
    fixed_pattern: bool
    sticking: float
    trial: np.ndarray


@record
class Path(NamedTuple):
    """State of a path.

    Attributes
    ----------
    numbers, counts : arrays, see above
    balance : (11,) array, J
        Numbers of `fsm.solve.outcome.energy_balance.EnergyBalance`.
    pair_energy : (2, n_pairs) array, J
        Energy that contact pairs have dissipated since the caller has read it.
    q, q_before : (nq,) arrays
        Present configuration and the one before.
    progress, states, efforts : (3,), (3, nq) and (3, m) arrays
        Path parameters, configurations and efforts of springs of the last states; `counts[KNOWN]` are known.
    record, earlier : records
        Present state, and (drives only) the state before.
    resting, resting_drives : (nu,) and (n_drives,) arrays
        Force and forces of the drives at rest in the present state.
    increment, next_efforts : (nu,) and (m,) arrays
        Predicted increment and efforts of a step.
    found, found_efforts : (nq,) and (m,) arrays
        Configuration and efforts that a step found.
    next_record, next_resting, next_resting_drives : of the state that a step found
    """

    numbers: np.ndarray
    counts: np.ndarray
    balance: np.ndarray
    pair_energy: np.ndarray
    q: np.ndarray
    q_before: np.ndarray
    progress: np.ndarray
    states: np.ndarray
    efforts: np.ndarray
    record: np.ndarray
    earlier: np.ndarray
    resting: np.ndarray
    resting_drives: np.ndarray
    increment: np.ndarray
    next_efforts: np.ndarray
    found: np.ndarray
    found_efforts: np.ndarray
    next_record: np.ndarray
    next_resting: np.ndarray
    next_resting_drives: np.ndarray

    @classmethod
    def of(cls, nq: int, nu: int, efforts: int, drives: int, pairs: int) -> Path:
        """State of zeros for systems of these sizes."""
        record = DRIVES + 2 * drives + 7 * pairs
        shapes: list[Any] = [
            9, 11, 11, (2, pairs), nq, nq, KEPT, (KEPT, nq), (KEPT, efforts), record, record, nu, drives, nu, efforts, nq,
            efforts, record, nu, drives,
        ]  # fmt: skip
        arrays = [np.zeros(shape) for shape in shapes]
        arrays[1] = np.zeros(11, dtype=np.int64)
        return cls(*arrays)

    def rows(self, count: int) -> np.ndarray:
        """Room for rows that describe states."""
        sizes = len(self.balance) + len(self.record) + self.pair_energy.size + len(self.q)
        return np.empty((count, BALANCE + sizes))

    def parts(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Balances, records, energies of contact pairs and configurations of rows; their first axis counts the rows."""
        record = BALANCE + len(self.balance)
        pairs = record + len(self.record)
        q = pairs + self.pair_energy.size
        return rows[:, BALANCE:record], rows[:, record:pairs], rows[:, pairs:q].reshape(len(rows), 2, -1), rows[:, q:]
