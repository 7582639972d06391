"""Largest normal stresses of bars of planar beam elements."""

from __future__ import annotations

import math

import numpy as np

from fsm.kernels.jit import kernel

_APART = math.sqrt(2.4)


@kernel
def _at_ends(strain: np.ndarray, ends: np.ndarray) -> None:
    """Values at both ends of an element, from a linear fit to the values at its three Gauss points."""
    mean, rise = (5.0 * strain[0] + 8.0 * strain[1] + 5.0 * strain[2]) / 18.0, (strain[0] - strain[2]) / _APART
    ends[0], ends[1] = mean + rise, mean - rise


@kernel
def bar_stresses(
    strain: np.ndarray, bars: np.ndarray, beside: np.ndarray, young: float, height: float
) -> np.ndarray:
    """Largest normal stress of each bar, at its surfaces and the ends of its elements, (n_bars,), Pa.

    Moments are largest at hinges, but hinges have no Gauss points. The strains at the Gauss points are therefore fitted
    by a linear function along the element. At the ends the fit is too low by s'' L^2/12. The second derivative s'' of
    the strain is taken from the slopes in the adjacent elements.

    Parameters
    ----------
    strain : (m, g, s) array
        Strains at the points of all elements: 3 of `fsm.model.nodes.beams.beam_green`, 4 of `beam_section`, 2 of
        `beam_bernoulli`.
    bars : (n_bars, 2) int array
        First element of each bar, and the element after its last one.
    beside : (m, 2) int array
        Elements before and after each element in its half of the bar; an end element contains its own number there.
    young, height : Pa, m
    """
    count, kinds = strain.shape[0], strain.shape[2]
    own, ends = np.empty((2, 3)), np.empty((2, count, 2))
    for e in range(count):
        for g in range(3):
            # Green's strains at two points of the section, at 1/sqrt(3) times the distance of the surfaces from the axis
            if kinds == 3:
                lower, upper = strain[e, 2 * g, 0], strain[e, 2 * g + 1, 0]
                own[0, g], own[1, g] = 0.5 * (lower + upper), 0.5 * math.sqrt(3.0) * (upper - lower)
            else:
                own[0, g], own[1, g] = strain[e, g, 0], 0.5 * height * strain[e, g, 2 if kinds == 4 else 1]
        for part in range(2):
            _at_ends(own[part], ends[part, e])
    out = np.zeros(bars.shape[0])
    for bar in range(bars.shape[0]):
        for e in range(bars[bar, 0], bars[bar, 1]):
            before, after = beside[e, 0], beside[e, 1]
            for side in range(2):
                total = 0.0
                for part in range(2):
                    rise = ends[part, after, 1] - ends[part, after, 0] - (ends[part, before, 1] - ends[part, before, 0])
                    total += abs(ends[part, e, side] + rise / max(1, after - before) / 12.0)
                out[bar] = max(out[bar], young * total)
    return out
