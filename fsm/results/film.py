"""What a result has of a tensioned film besides its states: probes, natural modes, stresses, and the samples of probes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["STATES", "Film", "Floats", "Integers", "Samples"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

STATES = ("taut", "wrinkled", "slack")
"""What the numbers of `Film.state` mean."""


@dataclass(frozen=True)
class Film:
    """The tensioned state that a vibration starts from and is about.

    Attributes
    ----------
    probe_names : tuple of str
    probe_rest : (n_probes, 3) array, m
    frequency : (n_modes,) array, Hz
        Natural frequencies; negative where the state is unstable, and grows.
    mode_shape : (n_modes, n_quads, 4, 3) array
        Motion of the corner points of every quad, the largest 1.
    stress : (n_quads, 2) array, Pa
        Principal stresses, mean of the element, the larger one first.
    direction : (n_quads, 3) array
        Unit vector along the larger one.
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


@dataclass
class Samples:
    """The probes between the records.

    Attributes
    ----------
    time : (m,) array, s
    displacement : (m, n_probes, 3) array, m
        From where each probe rests, along the film's length there, across it, and normal to it.
    """

    time: Floats = field(default_factory=lambda: np.zeros(0))
    displacement: Floats = field(default_factory=lambda: np.zeros((0, 0, 3)))

    def first(self, count: int) -> Samples:
        """The first so many."""
        return Samples(self.time[:count], self.displacement[:count])
