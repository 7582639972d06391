"""Energies of bodies and ANCF elements together."""

from __future__ import annotations

from fsm.solve.interface.records import Energy


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
