"""Whether a run records channels."""

from __future__ import annotations

from fsm.case.models.case import Case
from fsm.case.models.scene import Scene


def records_channels(case: Case, scene: Scene | None) -> bool:
    """Whether a run of a case and its scene records channels: those that the case names, and those of ideal joints."""
    return bool(case.save.channels or case.report or (scene is not None and scene.joints))
