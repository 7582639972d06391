"""The System of bars that share points: a scissor array."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from fsm.model.nodes.beams.array_beams import note_stress
from fsm.model.nodes.beams.bar_stress import bar_stresses
from fsm.model.nodes.beams.bars import BarMaterial, BarNodes
from fsm.model.nodes.beams.beam_group import BeamGroup
from fsm.model.nodes.beams.hinge import HingeGroup, Latches, latch_hinges
from fsm.model.nodes.loading import Loading
from fsm.model.nodes.mesh import Mesh
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.interface.records import PreviousState
from fsm.solve.interface.scales import OF_DRIVES, Scales

_RESOLVED = 1e-10
"""Strain to which Newton's method resolves forces at any tolerance, so that accelerations are smooth."""
_FOLLOWED = 0.1
"""Shortest step times omega of the shortest wave that the mesh resolves; the error of its amplitude is then 1e-4 a step."""

_WITH_MIXED = 7
"""Vectors of an element whose last vector is a mixed derivative r_xy, 1/m; see `fsm.model.nodes.beams.beam_strain`."""


class ScissorSystem(AncfSystem):
    """A scissor array behind the `System` protocol.

    Attributes
    ----------
    points : dict
        First coordinate of every point's position, by name.
    bars : nodes of every bar
    beams : BeamGroup
    material : BarMaterial
    hinges : HingeGroup, or None
    latches : Latches, or None
    largest : (n_bars,) array, Pa
        Largest normal stress of each bar at the steps so far.
    """

    def __init__(
        self,
        mesh: Mesh,
        loading: Loading,
        points: dict[str, int],
        bars: tuple[BarNodes, ...],
        material: BarMaterial,
        hinges: HingeGroup | None,
        latches: Latches | None = None,
    ) -> None:
        self.points, self.bars, self.material, self.hinges, self.latches = points, bars, material, hinges, latches
        self.beams: BeamGroup = next(group for group in mesh.groups if isinstance(group, BeamGroup))
        self.largest = np.zeros(len(bars))
        super().__init__(mesh, loading)

    @cached_property
    def _scales(self) -> Scales:
        """Scales of the system; the scale of length is the length of an element.

        The scale of velocity is the material velocity in an axial wave whose amplitude is the length of an element. Errors
        of waves that the mesh resolves are therefore measured by their displacements.
        """
        length = float(np.median(np.concatenate([np.diff(bar.at) for bar in self.bars])))
        reach = float(np.ptp(self.mesh.positions(self.start), axis=0).max())
        is_position = self.mesh.is_position
        wave = math.sqrt(self.material.young / self.material.density)
        drives, resolution = OF_DRIVES * self.loading.fastest, _RESOLVED * length
        power = is_position.astype(int)
        if self.beams.vectors.shape[1] == _WITH_MIXED:
            power[self.beams.vectors[:, -1:] + np.arange(2)] = -1
        return Scales.of(length, reach, drives, wave, power, power, ~self.fixed, resolution)

    def shortest_step(self) -> float:
        """See `System`; the result is a fraction of 1/omega of the shortest bending wave that the mesh resolves, which is
        four elements long.

        Here omega = k^2 sqrt(EI/(rho A)), k = pi/(2 L), or the frequency of the axial wave, k sqrt(E/rho), if it is lower
        (deep bars). Waves of shear and of the section's stretch are much faster, carry little energy, and start wherever a
        moment jumps.
        """
        length = self._scales.length
        number, speed = 0.5 * math.pi / length, math.sqrt(self.material.young / self.material.density)
        return _FOLLOWED / (number * speed * min(1.0, number * self.material.height / math.sqrt(12.0)))

    def commit(self, t: float, q: np.ndarray, u: np.ndarray, before: PreviousState | None = None) -> None:
        """See `System`."""
        np.maximum(self.largest, self.stress(q), out=self.largest)
        if self.latches is not None:
            self.latches.commit(t, q, u)

    def memory(self) -> np.ndarray:
        """See `System`: largest stress of each bar so far, Pa, and time at which each hinge latched, s."""
        return np.concatenate([self.largest, [] if self.latches is None else self.latches.times])

    def restore(self, memory: np.ndarray) -> None:
        """See `System`."""
        count = len(self.largest)
        self.largest[:] = memory[:count] if len(memory) else 0.0
        if self.latches is not None:
            self.latches.restore(memory[count:])

    def accepting(self) -> list[tuple[Any, list[np.ndarray]]]:
        """See `AncfSystem`: largest stresses, and latches."""
        sizes = np.array([self.material.young, self.material.height])
        of_bars = [*self.beams.table, *self._beside, sizes, self.largest]
        of_hinges = [] if self.latches is None else [(latch_hinges, list(self.latches.hinges.arrays))]
        return [(note_stress, of_bars), *of_hinges]

    def stress(self, q: np.ndarray) -> np.ndarray:
        """Largest normal stress of each bar, (n_bars,), Pa; see `fsm.model.nodes.beams.bar_stress`."""
        strain = self.beams.strained(q).strain
        return np.asarray(bar_stresses(strain, *self._beside, self.material.young, self.material.height))

    @cached_property
    def _beside(self) -> tuple[np.ndarray, np.ndarray]:
        """Elements of each bar, and elements beside each element; see `fsm.model.nodes.beams.bar_stress`."""
        before = np.arange(len(self.beams.vectors))
        after = before.copy()
        hinges = set(self.points.values())
        for bar in self.bars:
            for element, position in enumerate(bar.positions[1:-1], start=bar.elements.start):
                if int(position) not in hinges:  # forces may jump at these times
                    after[element], before[element + 1] = element + 1, element
        bars = np.array([(bar.elements.start, bar.elements.stop) for bar in self.bars], dtype=np.int64)
        return bars, np.ascontiguousarray(np.column_stack([before, after]))

    def shape(self, t: float, q: np.ndarray) -> np.ndarray:
        """See `System`: axes of all elements, with the width of the bars across the plane; y of the plane is z."""
        half = np.array([-0.5, -0.5, 0.5, 0.5]) * self.material.width
        quads = []
        for bar in self.bars:
            at = q[bar.positions[:, None] + np.arange(2)]
            corners = np.stack([at[:-1], at[1:], at[1:], at[:-1]], axis=1)
            quads.append(np.stack([corners[..., 0], np.broadcast_to(half, corners.shape[:2]), corners[..., 1]], axis=-1))
        return np.concatenate(quads)
