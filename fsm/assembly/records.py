"""Energies and scales of bodies and ANCF elements together."""

from __future__ import annotations

import numpy as np

from fsm.system_records import Energy, Scales

__all__ = ["joined_energy", "joined_scales"]


def joined_energy(bodies: Energy, nodes: Energy, power: float = 0.0) -> Energy:
    """Sum of the energies and powers of bodies and of ANCF elements; `power` is the power of other loads on these
    elements, W.
    """
    potential = dict(bodies.potential)
    for name, value in nodes.potential.items():
        potential[name] = potential.get(name, 0.0) + value
    return Energy(
        bodies.kinetic + nodes.kinetic,
        potential,
        bodies.dissipated_power + nodes.dissipated_power,
        bodies.input_power + nodes.input_power + power,
        bodies.pair_power,
        bodies.sliding_power + nodes.sliding_power,
        bodies.driven,
        (bodies.load_power or 0.0) + nodes.input_power + power,
    )


def joined_scales(bodies: Scales, nodes: Scales, free: int, is_position: np.ndarray) -> Scales:
    """Scales of free bodies in space and of nodes, whose coordinates are positions or slopes; the shorter of both
    lengths is used.
    """
    length = min(bodies.length, nodes.length)
    in_u = np.tile(np.arange(6) < 3, free)
    in_q = np.tile(np.arange(7) < 3, free)
    span = np.concatenate([in_u, is_position])
    return Scales(
        length,
        np.where(np.concatenate([in_q, is_position]), length, 1.0),
        np.concatenate([bodies.velocity, nodes.velocity]),
        np.where(span, length, 1.0),
        np.where(span, max(bodies.largest_span, nodes.largest_span), 1.0),
        np.concatenate([bodies.resolution, nodes.resolution]),
    )
