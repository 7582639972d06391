"""All quantities of a result as channels: recorded ones, and those that every record has (drives, energies, contacts)."""

from __future__ import annotations

from fsm.results.channel import Channel, ChannelInfo, Dim
from fsm.results.solution import ENERGIES, PAIRS, Solution

CONTACT_QUANTITIES: dict[str, tuple[str, str, str]] = {
    "gap": ("pair_gap", *PAIRS["pair_gap"]),
    "normal_force": ("pair_force", *PAIRS["pair_force"]),
    "friction_force": ("pair_friction", *PAIRS["pair_friction"]),
    "slip_speed": ("pair_slip", *PAIRS["pair_slip"]),
    "area": ("pair_area", *PAIRS["pair_area"]),
}
"""Quantities of the channels `contact.<pair>`: field of a record, unit and description."""


def all_channels(solution: Solution) -> dict[str, Channel]:
    """Channels by name: drives, energies and contacts of the records, points and bars of an array, then recorded channels.

    A recorded channel replaces a quantity of the records with the same name. Energies that are always zero are left
    out.
    """
    found: dict[str, Channel] = {}

    def add(name: str, unit: str, text: str, values: object, dims: tuple[Dim, ...] = ()) -> None:
        found[name] = Channel(ChannelInfo(name, unit, dims, text), values)  # type: ignore[arg-type]

    for k in range(solution.travel.shape[1]):
        names = (("turn", "rad"), ("moment", "N m")) if solution.layout.turns(k) else (("travel", "m"), ("force", "N"))
        for (name, unit), values, text in zip(
            names, (solution.travel, solution.force), ("motion of the drive", "reaction of the drive"), strict=True
        ):
            add(f"drive.{k + 1}.{name}", unit, text, values[:, k])
    for name, values in solution.energy.items():
        if values.any():
            add(f"energy.{name}", "J", ENERGIES[name], values)
    for k, pair in enumerate(solution.layout.pair_names):
        for name, (field, unit, text) in CONTACT_QUANTITIES.items():
            add(f"contact.{pair}.{name}", unit, text, getattr(solution, field)[:, k])
    if solution.array is not None:
        plane = Dim("plane_axis", ("x", "y"), "1", "axis of the plane of the array")
        motion = solution.array
        for k, name in enumerate(motion.point_names):
            place = motion.start[k] + motion.points.displacement[:, k]
            add(f"point.{name}.position", "m", "position of the point", place, (plane,))
            add(f"point.{name}.velocity", "m/s", "velocity of the point", motion.points.velocity[:, k], (plane,))
        for k, name in enumerate(motion.bar_names[: motion.stress.shape[1]]):
            add(f"bar.{name}.stress", "Pa", "largest normal stress of the bar", motion.stress[:, k])
    return found | solution.channels
