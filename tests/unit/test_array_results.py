"""Results of a scissor array: asynchronism along each unit, and the legend of its plot of stresses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from fsm.analyses.choose import analysis_of
from fsm.builders.scissor_bodies import build_bodies
from fsm.case.models.case import Case
from fsm.case.models.scissor import Stop
from fsm.model.nodes.system.scissor_system import ScissorSystem
from fsm.results.array import ArrayMotion, PointMotion, asynchronism
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from fsm.views.plots import scissor
from fsm.views.plots.style import figure

UNITS = 8


def array(angles: np.ndarray, base: np.ndarray, heights: np.ndarray) -> ArrayMotion:
    """Points a and b at the ends of lines across the array: directions (k,), initial radii (k, 2), heights over time (n,
    k)."""
    count = len(angles)
    names = tuple(f"{side}{k + 1}" for side in "ab" for k in range(count))
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    upper = base + heights[..., None] * along
    place = np.concatenate([upper, np.broadcast_to(base, upper.shape)], axis=1)
    still = np.zeros_like(place)
    points = PointMotion(place - place[0], still, still)
    bars = tuple(f"bar {k}" for k in range(2 * UNITS))
    return ArrayMotion(names, place[0], points, None, bars, np.ones((len(heights), 2 * UNITS)) * np.arange(2 * UNITS))


def test_a_ring_that_deploys_evenly_is_synchronous() -> None:
    """All units contract equally along their own radius; a unit that lags shows the size of its lag."""
    angles = 2.0 * np.pi * np.arange(UNITS) / UNITS
    base = np.column_stack([np.cos(angles), np.sin(angles)])
    heights = np.repeat(np.linspace(0.5, 0.2, 5)[:, None], UNITS, axis=1)
    assert max(np.abs(apart).max() for apart in asynchronism(array(angles, base, heights)).values()) < 1e-12
    heights[:, 3] += np.linspace(0.0, 0.01, 5)
    apart = asynchronism(array(angles, base, heights))
    assert apart["a3-a4"][-1] == pytest.approx(-0.01) and apart["a4-a5"][-1] == pytest.approx(0.01)


def test_a_straight_array_is_compared_along_its_own_direction() -> None:
    angles = np.full(4, 0.3)
    base = np.arange(4)[:, None] * np.array([-np.sin(0.3), np.cos(0.3)])
    heights = np.array([[0.5, 0.5, 0.5, 0.5], [0.4, 0.4, 0.37, 0.4]])
    assert asynchronism(array(angles, base, heights))["a2-a3"] == pytest.approx([0.0, 0.03])


@pytest.mark.parametrize("element", ["section", "green", "cable"])
def test_stress_is_that_of_the_surface_with_every_element(element: str) -> None:
    """Bars bent to arcs, kappa = 4e-3/m: E h/2 kappa. With Green's strain the stress was that at the Gauss points across the
    bar."""
    case = Case.model_validate({
        "analysis": "scissor", "bar": {"width": 0.02, "height": 0.012}, "solve": {"end_time": 1.0},
        "scissor": {"shape": "linear", "units": 1, "bar_length": 1.0, "initial_angle": 1.2, "element": element},
        "material": {"young": 2e11, "density": 7850.0, "poisson": 0.0},
    })  # fmt: skip
    system = analysis_of(case, "case.toml", []).system
    assert isinstance(system, ScissorSystem)
    start, kappa = system.initial()[0], 4e-3
    q = start.copy()
    pair = np.arange(2)
    for bar in system.bars:
        heading = math.atan2(*start[bar.slopes[0] + pair][::-1])
        middle = len(bar.at) // 2
        for vectors, first in zip(system.beams.vectors[bar.elements], bar.at[:-1], strict=True):
            ends = np.array([first, first + bar.at[1]])
            angle = heading + kappa * (ends - bar.at[middle])
            along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
            place = start[bar.positions[middle] + pair] + (np.array([np.sin(angle) - math.sin(heading),
                                                           math.cos(heading) - np.cos(angle)]).T / kappa)  # fmt: skip
            values = [place[0], along[:, 0], across[:, 0], place[1], along[:, 1], across[:, 1], -kappa * along[:, 0]]
            if element == "cable":
                values = [values[i] for i in (0, 1, 3, 4)]
            for vector, value in zip(vectors, values, strict=True):
                q[vector + pair] = value
    np.testing.assert_allclose(system.stress(q), 2e11 * 0.006 * kappa, rtol=1e-4)


def test_units_of_a_stop() -> None:
    stop = Stop.model_validate({"angle": "30 deg", "stiffness": "2000 N m/rad^1.5", "damping": "0.5 s/rad"})
    assert (stop.stiffness, stop.damping) == (2000.0, 0.5)
    plain = Stop.model_validate({"angle": 0.5, "stiffness": 2e6}, context={"units": "mm-N-s"})
    assert plain.stiffness == pytest.approx(2000.0)  # N mm/rad^1.5


def test_every_bar_has_a_name_and_a_line_of_its_own(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    figures: list[Figure] = []

    @contextmanager
    def kept(*arguments: Any) -> Iterator[Figure]:
        with figure(*arguments) as fig:
            figures.append(fig)
            yield fig

    monkeypatch.setattr(scissor, "figure", kept)
    motion = array(np.zeros(2), np.zeros((2, 2)), np.ones((3, 2)))
    solution: Any = SimpleNamespace(array=motion, time=np.arange(3.0))
    scissor.plot_stress(solution, tmp_path / "stress.png")
    (fig,) = figures
    legends = [*fig.legends, *filter(None, (ax.get_legend() for ax in fig.axes))]
    assert [text.get_text() for legend in legends for text in legend.get_texts()] == list(motion.bar_names)
    lines = {(line.get_color(), line.get_linestyle()) for line in fig.axes[0].lines}
    assert len(lines) == len(motion.bar_names)


@pytest.mark.parametrize("units", [3, 4, 6, 9])
def test_hinges_of_a_ring_are_alike(units: int) -> None:
    """Rigid bars: every middle hinge has the same angle within half a turn, and its spring winds the same way."""
    case = Case.model_validate(
        {
            "analysis": "scissor",
            "scissor": {
                "shape": "ring", "units": units, "bar_length": 0.5, "initial_angle": math.pi / units + 0.2, "rigid": True,
            },
            "bar": {"width": 0.02, "height": 0.02},
            "hinge": {"stiffness": 1.0, "rest_turn": 0.3, "at": "middle"},
            "material": {"young": 2e10, "density": 1200},
            "force": [{"point": "a1", "radial": 1.0}],
            "solve": {"end_time": 0.1},
        }
    )  # fmt: skip
    assert case.scissor is not None and case.bar is not None and case.material is not None
    scene = build_bodies(case.scissor, case.bar, case.material, (), case.force, case.hinge, (0.0, 0.0))
    hinges = [element for element in scene.elements if element.name.startswith("hinge h")]
    angles, rests = (np.array([getattr(hinge, name) for hinge in hinges]) for name in ("initial_angle", "rest_angle"))
    assert len(hinges) == units and np.all(np.abs(angles) <= math.pi)
    assert np.ptp(angles) < 1e-9 and np.ptp(rests) < 1e-9


def test_a_sudden_force_does_not_make_rigid_bars_ring_on_their_hinges() -> None:
    """Light bars under an impulse need few steps, since the stiff springs of the hinges are damped; and the energy
    balances."""
    case = Case.model_validate(
        {
            "analysis": "scissor",
            "scissor": {"units": 3, "bar_length": 1.0, "initial_angle": 1.3, "rigid": True},
            "bar": {"width": 0.02, "height": 0.02},
            "material": {"young": 5e9, "density": 1200},
            "force": [{"point": "a1", "force": [0, -50]}],
            "solve": {"end_time": 0.05},
        }
    )
    settings = Settings("Radau-blocks", 1e-6, 0.05)
    statistics, energy_balance = simulate(analysis_of(case).system, settings, [0.05], lambda saved: None)
    assert statistics.steps < 500
    assert energy_balance.relative_error < 1e-3
