"""Travel and force of every drive."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fsm.channels.offer import Model, Offer, State, offers


@offers
def drives(model: Model) -> Iterator[Offer]:
    """drive.1.travel, drive.1.force, ...: numbers from 1, in the order of the case."""
    for k in range(len(getattr(model.system, "motions", ()))):
        yield Offer(f"drive.{k + 1}.travel", "m", "travel of the drive", _of("travel", k))
        yield Offer(f"drive.{k + 1}.force", "N", "force along the direction of the drive", _of("force", k))


def _of(quantity: str, k: int) -> Callable[[State], float]:
    return lambda state: float(getattr(state.saved.observation.drive, quantity)[k])
