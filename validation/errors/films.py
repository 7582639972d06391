"""Random films: errors of the natural frequencies due to the mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fsm.analyses.film import build_film
from fsm.analyses.natural import natural_modes
from fsm.analyses.stretch import stretched
from fsm.analyses.vibrate import VibrationAnalysis
from fsm.case.derived.membrane import MeshLines, mesh_lines, place_patches
from fsm.case.loading.load_case import load_tables
from fsm.case.models.case import Case
from fsm.errors import CaseError, NotConverged
from fsm.model.nodes.loading import Loading
from validation.errors.coverage import Kind, Number

__all__ = ["KINDS"]

_MODES = 6
_FINER = 4


def _film(random: np.random.Generator, patches: bool, pulled: bool) -> dict[str, Any]:
    length = float(random.uniform(0.1, 0.5))
    width = length * float(random.uniform(0.5, 1.0))
    across = int(random.integers(5, 11))
    thickness = float(10.0 ** random.uniform(-5.0, -4.0))
    data: dict[str, Any] = {
        "analysis": "vibrate",
        "membrane": {
            "length": length, "width": width, "thickness": thickness,
            "mesh": [round(across * length / width), across],
        },
        "material": {"young": 3e9, "poisson": float(random.uniform(0.0, 0.4)), "density": 1400.0},
        "vibration": {"modes": _MODES},
    }  # fmt: skip
    strain = float(10.0 ** random.uniform(-3.5, -2.5))
    if pulled:
        data["tension"] = {"pull": strain * 3e9 * thickness * width, "film": "tension-field"}
    else:
        data["tension"] = {"strain": [strain, strain * float(random.uniform(0.4, 1.0))]}
    if patches:
        size = width * float(random.uniform(0.08, 0.3))
        free = 0.5 * np.array([length, width]) - 0.6 * size
        data["patch"] = [{
            "place": "position", "size": size, "thickness": thickness * float(random.uniform(1.5, 10.0)),
            "young": float(10.0 ** random.uniform(9.5, 11.0)), "density": float(random.uniform(1000.0, 8000.0)),
            "position": (free * random.uniform(-1.0, 1.0, 2)).tolist(),
        }]  # fmt: skip
    return data


def _lines(case: Case, times: int) -> MeshLines:
    """Lines of the case with every cell divided into equal parts."""
    assert case.membrane is not None
    lines = mesh_lines(case.membrane, place_patches(case.membrane, dict(enumerate(case.patch))))

    def parts(given: tuple[float, ...]) -> tuple[float, ...]:
        at = np.arange((len(given) - 1) * times + 1) / times
        return tuple(np.interp(at, np.arange(len(given)), given).tolist())

    return MeshLines(parts(lines.x), parts(lines.y))


@dataclass(frozen=True)
class _Frequencies:
    patches: bool
    pulled: bool

    def __call__(self, random: np.random.Generator) -> Iterator[Number]:
        for _ in range(20):
            try:
                case = load_tables(_film(random, self.patches, self.pulled), (), Path("film")).case
                analysis = VibrationAnalysis(case, "")
                analysis.initialise([])
            except (CaseError, NotConverged):  # slack, or too coarse for a patch
                continue
            break
        else:
            return
        own = analysis.modes.frequencies
        finer = [self._modes(case, times) for times in (_FINER // 2, _FINER)]
        reference = 2.0 * finer[1] - finer[0]  # of first order
        stated = np.full(len(own), np.nan) if analysis.mesh_error is None else analysis.mesh_error.modes
        for k in range(_MODES):
            known = bool(np.isfinite(stated[k]))
            yield Number(f"mode {k + 1}", float(stated[k]) if known else None, abs(float(reference[k] / own[k]) - 1.0))

    @staticmethod
    def _modes(case: Case, times: int) -> np.ndarray:
        film = build_film(case, _lines(case, times))
        system = stretched(case, film, Loading())
        return natural_modes(system, system.initial()[0], _MODES).frequencies


KINDS = {
    "taut films": Kind("frequencies of taut films", _Frequencies(False, False)),
    "films with a patch": Kind("frequencies of taut films with a patch", _Frequencies(True, False)),
    "pulled films": Kind("frequencies of pulled films, wrinkled", _Frequencies(False, True)),
    "pulled films with a patch": Kind("frequencies of pulled films with a patch", _Frequencies(True, True)),
}
