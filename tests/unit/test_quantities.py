"""Peak, stages and summary, from curves whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsm.results.quantities import find_stages, first_touch, peak, summarise
from fsm.results.solution import Layout, Record, Solution


@given(
    top=st.floats(-5, 5),
    height=st.floats(-3, 3),
    curvature=st.floats(0.1, 50),
    steps=st.lists(st.floats(0.05, 2), min_size=8, max_size=30),
)
def test_peak_of_a_parabola_is_exact_at_any_spacing(
    top: float, height: float, curvature: float, steps: list[float]
) -> None:
    x = np.cumsum(steps)
    x += top - x[len(x) // 2] + 0.3 * steps[len(x) // 2]  # the top lies between records
    force, at = peak(x, height - curvature * (x - top) ** 2)
    assert at == pytest.approx(top, abs=1e-7)
    assert force == pytest.approx(height, abs=1e-7)


def test_peak_converges_at_third_order_or_better() -> None:
    errors = []
    for n in (40, 80, 160, 320):
        x = np.linspace(0, 3, n + 1)
        errors.append(abs(peak(x, x * np.exp(-x))[0] - np.exp(-1)))
    assert errors[0] < 2e-5
    assert errors[-1] < errors[0] / 8**2


def test_peak_at_an_end_is_the_end() -> None:
    x = np.linspace(0, 1, 11)
    assert peak(x, x) == (1.0, 1.0)
    assert peak(x, -x) == (0.0, 0.0)
    assert peak([0.2], [3.0]) == (3.0, 0.2)


def test_peak_passes_over_standing_still_and_gaps() -> None:
    s = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0])
    f = np.array([0.0, 3.0, 4.0, 4.0, 3.0, 0.0])
    assert peak(s, f) == pytest.approx((4.0, 2.0))
    f[4] = np.nan
    assert peak(s, f)[0] == pytest.approx(4.0, abs=0.2)
    with pytest.raises(ValueError, match="finite"):
        peak([0.0], [np.nan])


def test_peak_of_a_flat_curve() -> None:
    assert peak([0.0, 1.0, 2.0], [1.0, 1.0, 1.0]) == (1.0, 0.0)


CONTACT, BENDING = 0.0133, 0.0217


def synthetic(n: int, contact: float = CONTACT, bending: float = BENDING) -> dict[str, np.ndarray]:
    """Energies whose rates cross at `bending`, and a pair that touches at `contact`."""
    s = np.linspace(0, 0.06, n)
    panels = 5 * s + 2000 * np.maximum(0, s - bending / 2) ** 2 / 2
    excess = 2000 * (bending - bending / 2)
    creases = (5 + excess) * s
    pairs = np.column_stack([np.zeros(n), 40 * np.maximum(0, s - contact)])
    energies = {"energy_panels": panels, "energy_creases": creases}
    return {"travel": s, "pair_force": pairs, "force": 3 * s} | energies


@pytest.mark.parametrize("n", [31, 61, 601])
def test_stages_of_a_known_curve(n: int) -> None:
    stages = find_stages(**synthetic(n))
    assert [stage.name for stage in stages] == ["initial deformation", "contact", "bending"]
    assert stages[0].travel == 0.0
    assert stages[1].travel == pytest.approx(CONTACT, abs=2e-5)
    assert stages[2].travel == pytest.approx(BENDING, abs=2e-5)
    for stage in stages:
        assert stage.force == pytest.approx(3 * stage.travel, abs=1e-9)


def test_contact_onset_of_a_hertz_force_lies_between_its_records() -> None:
    s = np.linspace(0, 0.06, 61)
    onset = first_touch(s, 1e4 * np.maximum(0, s - 0.0133)[:, None] ** 1.5)[0]
    assert onset is not None
    assert 0.013 <= onset <= 0.014
    assert onset == pytest.approx(0.0133, abs=4e-4)


def test_noise_below_the_threshold_is_no_contact() -> None:
    curve = synthetic(61)
    curve["pair_force"][:, 0] = 1e-6
    assert find_stages(**curve)[1].travel == pytest.approx(CONTACT, abs=2e-5)


def test_bending_before_contact_counts_from_contact() -> None:
    stages = find_stages(**synthetic(121, contact=0.03, bending=0.01))
    assert stages[2].travel == stages[1].travel == pytest.approx(0.03, abs=1e-6)


def test_stages_not_reached_are_absent() -> None:
    curve = synthetic(61)
    none = curve | {"pair_force": np.zeros((61, 0))}
    assert [stage.name for stage in find_stages(**none)] == ["initial deformation"]
    apart = curve | {"pair_force": np.zeros((61, 2))}
    assert [stage.name for stage in find_stages(**apart)] == ["initial deformation"]
    stiff = curve | {"energy_panels": 0.4 * curve["energy_creases"]}
    assert [stage.name for stage in find_stages(**stiff)] == ["initial deformation", "contact"]
    assert find_stages(**{name: values[:0] for name, values in curve.items()}) == []


def test_one_interval_is_not_bending() -> None:
    curve = synthetic(61)
    curve["energy_panels"] = 0.3 * curve["energy_creases"]
    curve["energy_panels"][40:] += 5 * np.diff(curve["energy_creases"])[0]
    assert len(find_stages(**curve)) == 2
    curve["energy_panels"][41:] += 5 * np.diff(curve["energy_creases"])[0]
    assert find_stages(**curve)[2].travel == pytest.approx(0.039, abs=1e-3)


def test_creases_and_panels_both_giving_back_is_not_bending() -> None:
    curve = synthetic(61)
    back = curve | {"energy_panels": -curve["travel"], "energy_creases": -2 * curve["travel"]}
    assert len(find_stages(**back)) == 2


def test_records_at_rest_after_the_drive_change_nothing() -> None:
    curve = synthetic(61)
    longer = {name: np.concatenate([values, values[-1:], values[-1:]]) for name, values in curve.items()}
    assert find_stages(**longer) == find_stages(**curve)


def run(n: int = 121, drives: int = 1) -> Solution:
    curve = synthetic(n)
    force = 2 - 3000 * (curve["travel"] - 0.03) ** 2
    records = [
        Record(
            time=float(k), q=np.zeros(2), u=np.zeros(2), travel=np.full(drives, curve["travel"][k]),
            force=np.full(drives, force[k]),
            energy={"panels": curve["energy_panels"][k], "creases": curve["energy_creases"][k]},
            pair_force=curve["pair_force"][k], pair_gap=np.zeros(2), shape=np.zeros((1, 4, 3)),
        )
        for k in range(n)
    ]  # fmt: skip
    names = tuple(f"crease {k}" for k in range(drives))
    return Solution.from_records(records, Layout(pair_names=("1-2", "3-4"), drive_names=names))


def test_summary() -> None:
    summary = summarise(run())
    assert summary["peak_force"] == pytest.approx(2.0, abs=1e-9)
    assert summary["peak_travel"] == pytest.approx(0.03, abs=1e-9)
    assert summary["final_travel"] == 0.06
    assert [stage["name"] for stage in summary["stages"]] == ["initial deformation", "contact", "bending"]
    assert summary["contact_travel"] == summary["stages"][1]["travel"]
    assert summary["bending_force"] == summary["stages"][2]["force"]
    assert [touch["pair"] for touch in summary["touches"]] == ["3-4"]
    assert summary["touches"][0]["travel"] == pytest.approx(CONTACT, abs=1e-6)


def test_summary_without_a_drive_is_empty() -> None:
    assert summarise(run(drives=0)) == {}
