"""Creases and bend lines of flexible facets and of bars: fold angles and moments."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fsm.analyses.fold_results import folds_of
from fsm.channels.offer import Model, Offer, State, offers
from fsm.model.elements.element_angles import side_of


@offers
def folds(model: Model) -> Iterator[Offer]:
    """crease.<number>.angle and .moment, bend_line.<number>.angle and .moment of flexible facets and of bars."""
    found = folds_of(model.scene)
    if found is None:
        return
    data = found.data

    def angles(state: State) -> np.ndarray:
        return found.angles(state.system, state.time, state.q)

    def moments(state: State) -> np.ndarray:
        return found.moments(state.system, state.time, state.q, state.u, state.before)

    for number, name in enumerate(data.names):
        first = int(np.argmax(data.joint == number))
        side = side_of(float(data.start[first]), float(data.rest[first]))
        key = f"{name.rpartition(' ')[0].replace(' ', '_')}.{name.rpartition(' ')[2]}"
        text = "mean crease angle: 0 flat, positive on the side to which the crease is folded at the start"
        yield Offer(f"{key}.angle", "rad", text, _of(angles, number, side))
        text = "moment of the crease, positive if its angle exceeds the rest angle"
        yield Offer(f"{key}.moment", "N m", text, _of(moments, number, side))


def _of(values: Callable[[State], np.ndarray], number: int, side: float) -> Callable[[State], float]:
    return lambda state: side * float(state.once(values)[number])
