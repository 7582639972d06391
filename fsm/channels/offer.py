"""Offers of channels: quantities that a model can record, and their functions of a saved state.

An offer function takes a `Model` and yields an `Offer` for each channel. The decorator `offers` registers it. All modules of
this folder are imported, so a new channel is one file here, or one in the file of a user (docs/extend/channel.md).

Poses, rates and wrenches of rigid bodies in three components, for planar and spatial systems alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fsm.analyses.film import FilmMesh
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.kernels.rotation import multiply, rotate_by
from fsm.model.bodies.group import PreviousPoses
from fsm.model.plan.planned import Plan
from fsm.results.channel import ChannelInfo, Dim
from fsm.solve.outcome.run_io import SavedState
from fsm.text.short_repr import ShortRepr


@dataclass(frozen=True)
class Model:
    """Compiled model on which the channels of a case depend.

    Attributes
    ----------
    case : Case
    system : System or None
        None for a film before its equilibrium is known.
    scene : Scene or None
        Description of the bodies and force elements.
    film : FilmMesh or None
        Mesh of a film.
    plan : Plan or None
        Steps of a case with `[[step]]`.
    analysis : Analysis or None
        Analysis that is solved; None in `fsm check`.
    """

    case: Case
    system: Any
    scene: Scene | None = None
    film: FilmMesh | None = None
    analysis: Any = None
    plan: Plan | None = None


@dataclass(repr=False)
class State(ShortRepr):
    """Saved state of a run, at which channels are evaluated.

    Attributes
    ----------
    system : System
        Its internal variables are those of this state.
    saved : SavedState
        Time, q, u, observation (drives, energies, contacts), and energy balance.
    """

    system: Any
    saved: SavedState
    _kept: dict[Any, Any] = field(default_factory=dict)

    @property
    def time(self) -> float:
        """Time, s."""
        return self.saved.time

    @property
    def q(self) -> np.ndarray:
        """Configuration, (nq,)."""
        return self.saved.q

    @property
    def u(self) -> np.ndarray | None:
        """Velocity, (nu,); in statics the mean velocity of the last step; None at rest, where drives also rest."""
        return None if self.saved.at_rest else self.saved.u

    @property
    def before(self) -> Any:
        """Previous state in statics; None in dynamics."""
        return self.saved.before

    def once(self, function: Callable[[State], Any]) -> Any:
        """Result of a function of the state. The function is called once for all channels that use it."""
        if function not in self._kept:
            self._kept[function] = function(self)
        return self._kept[function]


@dataclass(frozen=True)
class Offer:
    """Channel that a model can record.

    Attributes
    ----------
    name, unit, text, dims : see `ChannelInfo`
    at : function
        Value at a `State`; an array with the shape of `dims`, or a number.
    """

    name: str
    unit: str
    text: str
    at: Callable[[State], Any]
    dims: tuple[Dim, ...] = ()

    @property
    def info(self) -> ChannelInfo:
        """Description for the results file."""
        return ChannelInfo(self.name, self.unit, self.dims, self.text)


OfferFunction = Callable[[Model], Iterable[Offer]]
_OFFERING: list[OfferFunction] = []


def offers(function: OfferFunction) -> OfferFunction:
    """Register a function that offers channels (a decorator)."""
    _OFFERING.append(function)
    return function


def offers_of(model: Model) -> dict[str, Offer]:
    """All channels of a model by name; a name that occurs again gets a number."""
    found: dict[str, Offer] = {}
    for offer in _all(model):
        if offer.name not in found:
            found[offer.name] = offer
            continue
        number = 2
        while f"{offer.name}#{number}" in found:
            number += 1
        found[f"{offer.name}#{number}"] = Offer(f"{offer.name}#{number}", offer.unit, offer.text, offer.at, offer.dims)
    return found


def _all(model: Model) -> Iterator[Offer]:
    for function in _OFFERING:
        yield from function(model)


def placed(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Poses and rates of all bodies in the coordinates of the system."""
    poses, rates = state.system.place(state.time, state.q, state.u, state.before)
    return np.array(poses), np.array(rates)


def motion_of_bodies(state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions, quaternions, velocities and angular velocities of all bodies in inertial axes, the ground first."""
    poses, rates = placed(state)
    turned = quaternions(poses)
    return positions(poses), turned, *in_space(rates, turned)


def past_of(state: State) -> PreviousPoses | None:
    """Poses of the previous state in statics, and the time since then."""
    if state.before is None or state.u is None:
        return None
    poses, _ = state.system.place(*state.before, None)
    return PreviousPoses(np.array(poses), state.time - state.before[0])


def positions(poses: np.ndarray) -> np.ndarray:
    """Positions (n, 3), m."""
    return poses[:, :3] if poses.shape[1] == 7 else np.stack([poses[:, 0], np.zeros(len(poses)), poses[:, 1]], axis=1)


def quaternions(poses: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4)."""
    if poses.shape[1] == 7:
        return poses[:, 3:]
    half, zero = 0.5 * poses[:, 2], np.zeros(len(poses))
    return np.stack([np.cos(half), zero, np.sin(half), zero], axis=1)


def in_space(rows: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First three and last three components (n, 3) each of rates or wrenches (n, 3 or 6), both in inertial axes.

    In space the last three are about the body axes; `turned` (n, 4) are the quaternions of the bodies.
    """
    if rows.shape[1] == 6:
        return rows[:, :3], rotated(turned, rows[:, 3:])
    zero = np.zeros(len(rows))
    return np.stack([rows[:, 0], zero, rows[:, 1]], axis=1), np.stack([zero, rows[:, 2], zero], axis=1)


def rotated(turned: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) rotated by quaternions (n, 4)."""
    return np.asarray(rotate_by(turned, vectors))


def rotation_since(start: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Rotation vector (3,), rad, in inertial axes, from one quaternion to another; its length is at most pi."""
    relative = np.asarray(multiply(turned, start * np.array([1.0, -1.0, -1.0, -1.0])))
    if relative[0] < 0.0:
        relative = -relative
    size = float(np.linalg.norm(relative[1:]))
    return relative[1:] * (2.0 if size < 1e-12 else 2.0 * np.arctan2(size, relative[0]) / size)
