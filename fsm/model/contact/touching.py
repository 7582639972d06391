"""Contact pairs of one geometry, with the scene from which their table is built."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fsm.case.models.scene import Body, ContactPair, Scene


class Touching(NamedTuple):
    """Contact pairs of one geometry.

    Attributes
    ----------
    scene : Scene without faults
    bodies : all bodies in the order of the system, starting with the ground
    poses : (n_bodies, 3 or 7) array
        Poses of the given scene.
    spatial : whether each body of the system has six degrees of freedom
    pairs : numbers of the pairs in the scene, and the pairs
    """

    scene: Scene
    bodies: tuple[Body, ...]
    poses: np.ndarray
    spatial: bool
    pairs: tuple[tuple[int, ContactPair], ...]

    @property
    def numbers(self) -> np.ndarray:
        """Number of each pair in the scene, (n,)."""
        return np.array([number for number, _ in self.pairs], dtype=np.int64)

    @property
    def ends(self) -> np.ndarray:
        """First and second body of each pair, (n, 2), for pairs whose sides are bodies."""
        index = {body.name: number for number, body in enumerate(self.bodies)}
        return np.array([[index[pair.first], index[pair.second]] for _, pair in self.pairs], dtype=np.int64)

    @property
    def parameters(self) -> list[dict[str, Any]]:
        """Parameters of each pair, in SI."""
        return [pair.parameters or {} for _, pair in self.pairs]
