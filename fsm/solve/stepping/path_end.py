"""End of a quasi-static step of a compiled model, in one call: contacts, energies, stability and forces at rest."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import kernel
from fsm.kernels.pointers import Pointer, typed_by

CROSSED, NEGATIVE, NEGATIVE_AT_REST, DISSIPATED, LOADS, SLIDING_JOINTS, CONTACT, GRAVITY, JOINTS = range(9)
"""Indices of the record of `end_of_step`. CROSSED is 1 if sides of a contact have passed through each other. NEGATIVE is the
number of negative pivots of the last matrix of the step, NEGATIVE_AT_REST that of the symmetric part of the stiffness at
rest; both may be UNKNOWN. DISSIPATED and LOADS are the powers of dampers and of loads (W), SLIDING_JOINTS is the part of
DISSIPATED that the memory of elements causes. CONTACT and GRAVITY are energies (J). JOINTS begins the energies of panels and
of creases (J)."""
CONTACT_SUMS = JOINTS + 2
"""Index of the first of seven values of each contact pair: the rows of `fsm.interactions.contact.pair_sums`, and the gap
(m)."""
UNKNOWN = -1.0
"""Number of pivots that the factors do not show with certainty."""


class PathCalls(NamedTuple):
    """`Pointer`s to kernels of a model, whose arrays hold the time and the last state of a quasi-static step.

    Attributes
    ----------
    end_of_step : ``end_of_step(model, q, trial, accurate, at_rest, record)``
        Write the record of a state. `trial` (nu,) is a vector of entries 1 and -1; if the solution of equations with this
        vector has an error above `accurate`, numbers of pivots are `UNKNOWN`. Without `at_rest` the stiffness and forces at
        rest are left out.
    accept : ``accept(model, q)``
        Accept the state: update the memory of contacts and the deformations of dampers.
    contact_force : ``contact_force(model, t, q)``
        Largest component of the forces of contacts at rest, N.
    """

    end_of_step: Any
    accept: Any
    contact_force: Any


class PathModel(NamedTuple):
    """Model at the ends of quasi-static steps: its kernels, and their first argument."""

    calls: PathCalls
    arrays: Any

    @classmethod
    def of(cls, kernels: PathCalls, arrays: Any, q: np.ndarray) -> PathModel:
        """Create a model from arrays and kernels; q (nq,) is an example of a configuration."""
        arguments = PathCalls((q, q, 0.0, True, q), (q,), (0.0, q))
        pointers = (Pointer(kernel, arrays, *rest) for kernel, rest in zip(kernels, arguments, strict=True))
        return cls(PathCalls(*pointers), arrays)


@kernel
def end_of_step(
    model: PathModel, q: np.ndarray, trial: np.ndarray, accurate: float, at_rest: bool, record: np.ndarray
) -> None:
    """See `PathCalls`."""
    model.calls.end_of_step(model.arrays, q, trial, accurate, at_rest, record)


@kernel
def accept_state(model: PathModel, q: np.ndarray) -> None:
    """See `PathCalls`."""
    model.calls.accept(model.arrays, q)


@kernel
def contact_force(model: PathModel, t: float, q: np.ndarray) -> float:
    """See `PathCalls`."""
    force: float = model.calls.contact_force(model.arrays, t, q)
    return force


typed_by(PathModel)
