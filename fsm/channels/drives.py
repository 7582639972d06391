"""Travel and force of every drive, or rotation and moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fsm.channels.offer import Model, Offer, State, offers


@offers
def drives(model: Model) -> Iterator[Offer]:
    """drive.1.travel, drive.1.force, or drive.1.turn, drive.1.moment: numbers from 1, in the order of the case."""
    for k, motion in enumerate(getattr(model.system, "motions", ())):
        name = f"drive.{k + 1}"
        if motion.axis is None:
            yield Offer(f"{name}.travel", "m", "travel of the drive", _of("travel", k))
            yield Offer(f"{name}.force", "N", "force along the direction of the drive", _of("force", k))
        else:
            yield Offer(f"{name}.turn", "rad", "rotation of the drive", _of("travel", k))
            yield Offer(f"{name}.moment", "N m", "moment about the axis of the drive", _of("force", k))


def _of(quantity: str, k: int) -> Callable[[State], float]:
    return lambda state: float(getattr(state.saved.observation.drive, quantity)[k])
