"""Benchmark: a scene, the compared states, the numbers of each state, and their references."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fsm.scene.scene import Scene
from fsm.segments.compile import compile_scene
from fsm.segments.system import SegmentSystem
from fsm.solve.run_io import SavedState

__all__ = ["Problem", "Tight"]


@dataclass(frozen=True)
class Tight:
    """A reference that is the same discrete system solved tightly: SciPy method and relative tolerance."""

    method: str
    rtol: float


@dataclass(frozen=True)
class Problem:
    """A benchmark scene.

    Attributes
    ----------
    name : of files, and for `--scenes`
    title : of its plot
    measure : what the error is, for the axis
    scene, spatial : what is compiled, and whether with six degrees of freedom a body in any case
    times : increasing times that are saved, s; the last one is the end
    sample : numbers taken from one saved state
    error : of all samples (one row a time) against the reference
    reference : rows as the samples, or how to make them
    static : whether a quasi-static path follower answers the same question
    tightest : smallest tolerance worth asking for: well above the reference's own, or where its error is reached
    """

    name: str
    title: str
    measure: str
    scene: Scene
    times: Sequence[float]
    sample: Callable[[SavedState], np.ndarray]
    error: Callable[[np.ndarray, np.ndarray], float]
    reference: np.ndarray | Tight
    spatial: bool = False
    static: bool = False
    tightest: float = 1e-7

    @property
    def end_time(self) -> float:
        """Time at which the solve ends, s."""
        return self.times[-1]

    def system(self) -> SegmentSystem:
        """A new system; systems keep what they found out about contacts, so each run takes its own."""
        return compile_scene(self.scene, self.spatial)

    def digest(self) -> str:
        """Digest of everything that determines a reference with a small tolerance, except the code of the forces."""
        text = f"{self.scene.model_dump_json()} {self.spatial} {list(self.times)} {self.reference!r}"
        return hashlib.sha256(text.encode()).hexdigest()[:12]
