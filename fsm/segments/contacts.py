"""Contact and friction of surfaces as a group: broad phase, closest points, laws, scatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from fsm.interactions.motion import moved_beyond
from fsm.kernels.scatter import scatter_efforts
from fsm.laws.friction import friction
from fsm.laws.normal_contact import hertz, hertz_energy
from fsm.segments.group import Past
from fsm.segments.pattern import BodyPattern

__all__ = ["ContactGroup", "ContactKernels", "FrictionLaw", "NormalLaw", "Probes"]

Kernel = Callable[..., Any]


class Probes(NamedTuple):
    """Points of one panel that watch the surface of another.

    Attributes
    ----------
    body : (n,) int array
    place : (n,) array of x in the plane, (n, 2) of (x, y) in space, m, body axes
    side : (n,) array
        +1 or -1: the side of the surface the probe starts on.
    straight : (n,) array
        Part of a tip of the surface that is straight for the probe.
    inset : (n,) array, m
        Half thickness of the probe's own panel.
    clearance : (n,) array, m
        Distance of the middle surfaces at which the faces touch.
    depth_limit : (n,) array, m
    share : (n,) array
        Fraction of its face that the point stands for.
    pair : (n,) int array
        Number of the contact pair.
    first_piece, last_piece : (n,) int arrays
        Pieces of the surface watched.
    """

    body: np.ndarray
    place: np.ndarray
    side: np.ndarray
    straight: np.ndarray
    inset: np.ndarray
    clearance: np.ndarray
    depth_limit: np.ndarray
    share: np.ndarray
    pair: np.ndarray
    first_piece: np.ndarray
    last_piece: np.ndarray


class NormalLaw(NamedTuple):
    """Parameters of `fsm.laws.normal_contact.hertz`: N/m^e, -, N s/m, m."""

    stiffness: float
    exponent: float
    damping: float
    ramp: float


class FrictionLaw(NamedTuple):
    """Parameters of `fsm.laws.friction.friction`: law number, -, -, m/s, m/s."""

    law: int
    mu_static: float
    mu_dynamic: float
    v_static: float
    v_dynamic: float


class ContactKernels(NamedTuple):
    """The four kernels of `fsm.interactions.gap_planar` or `gap_spatial`."""

    window: Kernel
    find: Kernel
    measure: Kernel
    tangent: Kernel


@dataclass
class _Found:
    """Contacts of one state, with forces."""

    count: int
    probe: np.ndarray
    piece: np.ndarray
    at: np.ndarray
    penetration: np.ndarray
    bodies: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray
    normal: np.ndarray
    slopes: np.ndarray
    effort: np.ndarray


class ContactGroup:
    """Contacts of all pairs of surfaces.

    The broad phase keeps, for each probe, the window of pieces it could reach; it is renewed when a body of a surface
    has moved by 0.4 of the margin since, so what is found never depends on when that happened.

    Parameters
    ----------
    kernels : ContactKernels
    probes : Probes
    owners, stations : pieces of all surfaces, see `fsm.interactions.surface`
    extra : arrays
        Further geometry the kernels take (half widths in space, nothing in the plane).
    surface_bodies, radii : (n,) arrays
        Bodies whose motion renews the broad phase, and the distance of their farthest point.
    margin : m
    normal : NormalLaw
    friction : FrictionLaw or None
    n_pairs : int
    """

    def __init__(
        self,
        kernels: ContactKernels,
        probes: Probes,
        owners: np.ndarray,
        stations: np.ndarray,
        extra: tuple[np.ndarray, ...],
        surface_bodies: np.ndarray,
        radii: np.ndarray,
        margin: float,
        normal: NormalLaw,
        friction_law: FrictionLaw | None,
        n_pairs: int,
    ) -> None:
        self.kernels = kernels
        self.probes = probes
        self.owners = owners
        self.stations = stations
        self.extra = extra
        self.surface_bodies = surface_bodies
        self.radii = radii
        self.margin = margin
        self.normal = normal
        self.friction = friction_law
        self.n_pairs = n_pairs
        self.refreshes = 0
        # a surface reaches beyond its chords by its tips, and a probe may be as deep as its limit
        beyond = np.maximum(-stations[:, 4], stations[:, 5] - 1.0) * (stations[:, 3] - stations[:, 0])
        self._reach = np.maximum(probes.clearance, probes.depth_limit) + float(beyond.max()) + margin
        count = len(probes.body)
        self._window = np.zeros((count, 2), dtype=np.int64)
        self._reference: np.ndarray | None = None
        self._pairs = np.zeros((0, 2), dtype=np.int64)
        self._last: tuple[np.ndarray, np.ndarray, _Found | None] | None = None
        self._buffers = (
            np.empty(count, dtype=np.int64),
            np.empty(count, dtype=np.int64),
            np.empty(probes.place.shape),
            np.empty(count),
        )

    @property
    def rate_dependent(self) -> bool:
        """See `Group`."""
        return self.friction is not None or self.normal.damping > 0.0

    def _refresh(self, poses: np.ndarray) -> None:
        # both may have moved; the rest of the margin is for what the surface departs from its chords
        if self._reference is not None and not moved_beyond(
            poses, self._reference, self.surface_bodies, self.radii, 0.4 * self.margin
        ):
            return
        self._reference = poses.copy()
        probes = self.probes
        self.kernels.window(
            poses, probes.body, probes.place, probes.first_piece, probes.last_piece, self.owners, self.stations,
            *self.extra, self._reach, self._window,
        )  # fmt: skip
        self._pairs = _coupled_bodies(probes.body, self._window, self.owners)
        self.refreshes += 1

    def _search(self, poses: np.ndarray, below: float) -> int:
        self._refresh(poses)
        probes = self.probes
        count: int = self.kernels.find(
            poses, probes.body, probes.place, probes.side, probes.straight, probes.clearance,
            probes.depth_limit, self._window,
            self.owners, self.stations, *self.extra, below, *self._buffers,
        )  # fmt: skip
        return count

    def _contacts(self, poses: np.ndarray, rates: np.ndarray) -> _Found | None:
        """Contacts of a state; asked for the very same arrays again (force, then energy), those of the last time."""
        if self._last is None or self._last[0] is not poses or self._last[1] is not rates:
            self._last = (poses, rates, self._find(poses, rates))
        return self._last[2]

    def _find(self, poses: np.ndarray, rates: np.ndarray) -> _Found | None:
        count = self._search(poses, 0.0)
        if count == 0:
            return None
        probe, piece, at, gap = (buffer[:count].copy() for buffer in self._buffers)
        probes = self.probes
        bodies, rate, gradient = self.kernels.measure(
            poses, rates, count, probe, piece, at, probes.body, probes.place, probes.side,
            probes.straight, probes.clearance, probes.inset, self.owners, self.stations, *self.extra,
        )  # fmt: skip
        penetration = -gap
        normal, normal_slopes = hertz(penetration, -rate[:, 0], probes.share[probe], *self.normal)
        effort = np.zeros(rate.shape)
        effort[:, 0] = -normal
        slopes = np.zeros((count, 4))
        slopes[:, :2] = normal_slopes
        if self.friction is not None:
            effort[:, 1:], slopes[:, 2:] = friction(np.ascontiguousarray(rate[:, 1:]), normal, *self.friction)
        return _Found(count, probe, piece, at, penetration, bodies, rate, gradient, normal, slopes, effort)

    def add_force(
        self, t: float, poses: np.ndarray, rates: np.ndarray, force: np.ndarray, past: Past | None = None
    ) -> None:
        """See `Group`."""
        found = self._contacts(poses, rates)
        if found is not None:
            scatter_efforts(found.bodies, found.gradient, found.effort, found.count, force)

    def add_linearised(
        self,
        t: float,
        poses: np.ndarray,
        rates: np.ndarray,
        pattern: BodyPattern,
        force: np.ndarray,
        stiffness: np.ndarray,
        damping: np.ndarray,
        past: Past | None = None,
    ) -> None:
        """See `Group`."""
        found = self._contacts(poses, rates)
        if found is None:
            return
        scatter_efforts(found.bodies, found.gradient, found.effort, found.count, force)
        probes = self.probes
        self.kernels.tangent(
            poses, rates, found.count, found.bodies, found.gradient, found.rate, found.probe, found.piece, found.at,
            probes.place, probes.side, probes.straight, probes.clearance, probes.inset, self.stations, *self.extra,
            found.normal, found.effort, found.slopes, self.friction is not None, *pattern.index, stiffness, damping,
        )  # fmt: skip

    def add_force_rate(self, t: float, poses: np.ndarray, force_rate: np.ndarray) -> None:
        """See `Group`; contacts do not know the time."""

    def energy(
        self, t: float, poses: np.ndarray, rates: np.ndarray, past: Past | None = None
    ) -> tuple[dict[str, float], float, float]:
        """See `Group`."""
        found = self._contacts(poses, rates)
        if found is None:
            return {"contact": 0.0}, 0.0, 0.0
        share = self.probes.share[found.probe]
        stored = hertz_energy(found.penetration, share, self.normal.stiffness, self.normal.exponent)
        elastic = share * self.normal.stiffness * found.penetration**self.normal.exponent
        dissipated = float((found.normal - elastic) @ -found.rate[:, 0] + np.sum(found.effort[:, 1:] * found.rate[:, 1:]))
        return {"contact": float(stored.sum())}, dissipated, 0.0

    def pairs(self, poses: np.ndarray) -> tuple[np.ndarray, int]:
        """See `Group`."""
        self._refresh(poses)
        return self._pairs, self.refreshes

    def observe(self, poses: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sum of normal forces (N) and smallest gap (m, at most the margin) of every pair, (n_pairs,) each."""
        force = np.zeros(self.n_pairs)
        gap = np.full(self.n_pairs, self.margin)
        found = self._contacts(poses, rates)
        if found is not None:
            np.add.at(force, self.probes.pair[found.probe], found.normal)
        count = self._search(poses, self.margin)
        np.minimum.at(gap, self.probes.pair[self._buffers[0][:count]], self._buffers[3][:count])
        return force, gap


def _coupled_bodies(probe_body: np.ndarray, window: np.ndarray, owners: np.ndarray) -> np.ndarray:
    """Pairs of bodies that a contact within the windows would couple: probe with piece bodies, and those together."""
    open_probes = np.flatnonzero(window[:, 1] > window[:, 0])
    if not len(open_probes):
        return np.zeros((0, 2), dtype=np.int64)
    lengths = window[open_probes, 1] - window[open_probes, 0]
    offsets = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    pieces = np.repeat(window[open_probes, 0], lengths) + offsets
    probe = np.repeat(probe_body[open_probes], lengths)
    first, second = owners[pieces, 0], owners[pieces, 1]
    count = int(max(probe.max(), owners.max())) + 1
    keys = np.unique(np.concatenate([probe * count + first, probe * count + second, first * count + second]))
    return np.column_stack(np.divmod(keys, count))
