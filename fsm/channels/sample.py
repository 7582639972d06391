"""Selection of the channels of a case, and their values at saved states."""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from fsm.analyses.scissor import ScissorArray
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.case.models.scene import Scene
from fsm.channels.offer import Model, Offer, State, offers_of
from fsm.errors import CaseError, Fault
from fsm.model.compile.compile_case import compile_whole
from fsm.model.plan.plan import plan_of
from fsm.model.system.step_system import whole_system
from fsm.results.channel import ChannelInfo, select_channels
from fsm.solve.outcome.run_io import SavedState

_LISTED = 20
"""Largest number of names that `fsm check` lists."""
_COORDINATES = ("angle", "angle_1", "angle_2", "displacement", "displacement_1", "displacement_2", "motor")
"""Channels of an ideal joint that lead the results of a case without `report`."""
_RECORDED = (*_COORDINATES, "force", "moment", "latched")
"""Channels of an ideal joint that are always recorded."""


def chosen(case: Case, scene: Scene | None, offered: Iterable[str]) -> tuple[list[str], list[str], list[Fault]]:
    """Names of the channels to record, in the order of the offers, of those that lead the results, and faults."""
    names = list(offered)
    led, faults = _of_report(case.report, names)
    recorded, more = select_channels(names, case.save.channels)
    seams = set[str]() if scene is None else {seam.name for seam in scene.seams}  # joints of seams are recorded on demand
    joints = () if scene is None else scene.joints
    of_joints = [f"joint.{joint.name}" for joint in joints if joint.name.rpartition(" (")[0] not in seams]
    if not case.report:
        led = [name for name in (f"{joint}.{of}" for joint in of_joints for of in _COORDINATES) if name in set(names)]
    kept = {*recorded, *led, *(f"{joint}.{of}" for joint in of_joints for of in _RECORDED)}
    return [name for name in names if name in kept], led, [*faults, *more]


def _of_report(patterns: Iterable[str], names: list[str]) -> tuple[list[str], list[Fault]]:
    """Channels that match the patterns of `report`, in their order; a pattern may leave out "joint."."""
    found: list[str] = []
    faults: list[Fault] = []
    for pattern in patterns:
        whole = pattern if any(fnmatchcase(name, pattern) for name in names) else f"joint.{pattern}"
        matches, fault = select_channels(names, [whole], "report")
        found, faults = [*found, *(name for name in matches if name not in found)], [*faults, *fault]
    return found, faults


class ChannelSampler:
    """Channels that a run records.

    Attributes
    ----------
    infos : descriptions of the channels
    report : names of the channels that lead the results
    """

    def __init__(self, model: Model) -> None:
        offered = offers_of(model)
        names, self.report, _ = chosen(model.case, model.scene, offered)
        self._offers: tuple[Offer, ...] = tuple(offered[name] for name in names)
        self.infos: tuple[ChannelInfo, ...] = tuple(offer.info for offer in self._offers)

    def values(self, system: Any, saved: SavedState) -> dict[str, np.ndarray]:
        """Value of every channel at a saved state; the internal variables of the system must belong to this state."""
        state = State(system, saved)
        return {
            offer.name: np.array(offer.at(state), dtype=float).reshape([len(dim.labels) for dim in offer.dims])
            for offer in self._offers
        }


def model_of_analysis(analysis: Any) -> Model:
    """Model of a compiled analysis that is ready to be solved."""
    parts = {name: getattr(analysis, name, None) for name in ("system", "scene", "film")}
    plan = analysis.plan if analysis.case.step else None
    return Model(case=analysis.case, analysis=analysis, plan=plan, **parts)


def models_of_case(case: Case, analysis: Any = None) -> list[Model]:
    """Models of all analyses of a case, as far as they are known without a solution.

    `analysis` is the compiled first analysis; without it, the case is compiled.
    """
    models: list[Model] = []
    for step in case.steps:
        if analysis is not None and not models:
            models.append(model_of_analysis(analysis))
        elif step == "deploy":
            scene = build_scene(case)
            plan = plan_of(case, scene) if case.step else None
            system = compile_whole(case, scene, plan)
            models.append(Model(case, system if plan is None else whole_system(system, scene, plan), scene, plan=plan))
        elif step == "scissor":
            models.append(Model(case, ScissorArray(case, "").system))
        else:
            analysis = VibrationAnalysis(case, "") if case.membrane is not None else None
            models.append(Model(case, None, film=None if analysis is None else analysis.film, analysis=analysis))
    return models


def check_patterns(case: Case, source: str = "", analysis: Any = None) -> dict[str, Offer]:
    """Channels of a case by name; a pattern without a match is an error.

    Parameters
    ----------
    case : Case
    source : name of the file in messages
    analysis : compiled first analysis of the case, if there is one

    Raises
    ------
    CaseError
        With a fault for every pattern that matches no channel of any analysis of the case.
    """
    offered, scene = _offered(case, source, analysis)
    faults = chosen(case, scene, offered)[2]
    if faults:
        raise CaseError(faults, source)
    return offered


def _offered(case: Case, source: str = "", analysis: Any = None) -> tuple[dict[str, Offer], Scene | None]:
    """Channels of a case by name, and the scene of its first analysis."""
    offered: dict[str, Offer] = {}
    try:
        models = models_of_case(case, analysis)
        for model in models:
            offered |= offers_of(model)
    except CaseError as error:
        raise CaseError(error.faults, error.source or source) from None
    return offered, models[0].scene


def channel_lines(case: Case) -> list[str]:
    """Lines of `fsm check`: the channels that are recorded with their units, and the number of all others.

    Raises
    ------
    CaseError
        A pattern matches no channel.
    """
    offered, scene = _offered(case)
    names, _, faults = chosen(case, scene, offered)
    if faults:
        raise CaseError(faults)
    lines = [f"{name} ({offered[name].unit})" for name in names[:_LISTED]]
    if len(names) > _LISTED:
        lines.append(f"... and {len(names) - _LISTED} more that match")
    kinds = sorted({name.split(".")[0] for name in offered})
    lines.append(f"{len(offered) - len(names)} other channels, of the kinds {', '.join(kinds)}")
    return lines
