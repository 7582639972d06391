"""Results of a tensioned film besides its records: probes and their samples, natural modes, stresses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fsm.text.short_repr import ShortRepr

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

STATES = ("taut", "wrinkled", "slack")
"""Names of the numbers in `Film.state`."""


@dataclass(frozen=True, repr=False)
class Film(ShortRepr):
    """Tensioned equilibrium of a film, about which it vibrates.

    Attributes
    ----------
    probe_names : tuple of str
    probe_rest : (n_probes, 3) array, m
    frequency : (n_modes,) array, Hz
        Natural frequencies; negative for an unstable mode.
    mode_shape : (n_modes, n_quads, 4, 3) array
        Motion of the corner points of every quad, scaled to a largest value of 1.
    stress : (n_quads, 2) array, Pa
        Principal stresses averaged over the element, the larger one first.
    direction : (n_quads, 3) array
        Unit vector along the larger principal stress.
    state : (n_quads,) array of int
        See `STATES`.
    """

    probe_names: tuple[str, ...]
    probe_rest: Floats
    frequency: Floats
    mode_shape: Floats
    stress: Floats
    direction: Floats
    state: Integers


@dataclass(repr=False)
class ProbeSamples(ShortRepr):
    """Samples of the probes, which are denser in time than the records.

    Attributes
    ----------
    time : (m,) array, s
    displacement : (m, n_probes, 3) array, m
        Displacement of each probe from its rest position: along the film, across it, and normal to it.
    """

    time: Floats = field(default_factory=lambda: np.zeros(0))
    displacement: Floats = field(default_factory=lambda: np.zeros((0, 0, 3)))

    def first(self, count: int) -> ProbeSamples:
        """Return the first `count` samples."""
        return ProbeSamples(self.time[:count], self.displacement[:count])

    def last(self, count: int) -> ProbeSamples:
        """Return the last `count` samples, at least one."""
        return ProbeSamples(self.time[-count:], self.displacement[-count:])
