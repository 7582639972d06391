"""Benchmark: a scene, the compared states, the numbers of each state, and their references."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fsm.case.models.scene import Scene
from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.run_io import SavedState

__all__ = ["Problem", "Tight"]


@dataclass(frozen=True)
class Tight:
    """Reference that is the same discrete system solved at a small tolerance: SciPy method and relative tolerance."""

    method: str
    rtol: float


@dataclass(frozen=True)
class Problem:
    """A benchmark scene.

    Attributes
    ----------
    name : name in files, and for `--scenes`
    title : title of its plot
    measure : description of the error, for the axis
    scene, spatial : the scene, and whether each body has six degrees of freedom in any case
    times : increasing times at which states are saved, s; the last time is the end
    sample : function that takes the compared numbers from one saved state
    error : function of all samples (one row for each time) and the reference
    reference : rows like the samples, or a function that computes them
    static : whether a quasi-static path follower can solve the problem
    tightest : smallest useful tolerance: well above the tolerance of the reference, or the tolerance at which the error of
    the reference is reached
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
        """A new system; each run has a separate system, because systems store data of the contact search."""
        return compile_scene(self.scene, self.spatial)

    def digest(self) -> str:
        """Digest of everything that determines a reference with a small tolerance, except the code of the forces."""
        text = f"{self.scene.model_dump_json()} {self.spatial} {list(self.times)} {self.reference!r}"
        return hashlib.sha256(text.encode()).hexdigest()[:12]
