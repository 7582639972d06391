"""Selection of the channels of a case, and their values at saved states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fsm.analyses.scissor import ScissorArray
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.builders.scene import build_scene
from fsm.case.models.case import Case
from fsm.channels.offer import Model, Offer, State, offers_of
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_whole
from fsm.model.plan.plan import plan_of
from fsm.model.system.step_system import whole_system
from fsm.results.channel import ChannelInfo, select_channels
from fsm.solve.outcome.run_io import SavedState

_LISTED = 20
"""Largest number of names that `fsm check` lists."""


class ChannelSampler:
    """Channels of a run that match the patterns of the case.

    Parameters
    ----------
    model : Model
    patterns : patterns of `[save] channels`

    Attributes
    ----------
    infos : descriptions of the channels
    """

    def __init__(self, model: Model, patterns: Sequence[str]) -> None:
        offered = offers_of(model) if patterns else {}
        names, _ = select_channels(offered, patterns)
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
    offered: dict[str, Offer] = {}
    try:
        for model in models_of_case(case, analysis):
            offered |= offers_of(model)
    except CaseError as error:
        raise CaseError(error.faults, error.source or source) from None
    _, faults = select_channels(offered, case.save.channels)
    if faults:
        raise CaseError(faults, source)
    return offered


def channel_lines(case: Case) -> list[str]:
    """Lines of `fsm check`: the channels that are recorded with their units, and the number of all others.

    Raises
    ------
    CaseError
        A pattern matches no channel.
    """
    offered = check_patterns(case)
    names, _ = select_channels(offered, case.save.channels)
    lines = [f"{name} ({offered[name].unit})" for name in names[:_LISTED]]
    if len(names) > _LISTED:
        lines.append(f"... and {len(names) - _LISTED} more that match")
    kinds = sorted({name.split(".")[0] for name in offered})
    lines.append(f"{len(offered) - len(names)} other channels, of the kinds {', '.join(kinds)}")
    return lines
