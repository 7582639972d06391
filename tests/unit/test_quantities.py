"""Peak, stages and summary of curves with known results."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fsm.results.curve import ForceCurve
from fsm.results.quantities import (
    BEND,
    bending_onset,
    bent_energy,
    find_stages,
    first_touch,
    peak,
    peaks,
    sliding_distance,
    summarise,
    summarise_contacts,
    touching_pairs,
)
from fsm.results.solution import Layout, Record, Solution


@given(
    top=st.floats(-5, 5),
    height=st.floats(-3, 3),
    curvature=st.floats(0.1, 50),
    steps=st.lists(st.floats(0.05, 2), min_size=8, max_size=30),
)
def test_peak_of_a_parabola_is_exact_at_any_spacing(top: float, height: float, curvature: float, steps: list[float]) -> None:
    x = np.cumsum(steps)
    x += top - x[len(x) // 2] + 0.3 * steps[len(x) // 2]  # the maximum lies between records
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
BENT = 2e-4


def curve_of(
    travel: np.ndarray,
    force: np.ndarray,
    pair_force: np.ndarray | None = None,
    share: np.ndarray | float = 0.0,
    path: np.ndarray | None = None,
) -> ForceCurve:
    """A curve of one drive; the panels have stored a share of the elastic energy, s^2 in total."""
    n = len(travel)
    pairs = np.zeros((n, 0)) if pair_force is None else pair_force
    number = np.zeros(n, dtype=np.int64) if path is None else path
    return ForceCurve(travel[:, None], force[:, None], pairs, travel, number, share * travel**2, (1 - share) * travel**2)


def synthetic(n: int, bending: float = BENDING) -> ForceCurve:
    """A pair touches at `CONTACT`; the energy of the panels grows with the square of the travel, to `BENT` at `bending`."""
    s = np.linspace(0, 0.06, n)
    pairs = np.column_stack([np.zeros(n), 40 * np.maximum(0, s - CONTACT)])
    return curve_of(s, 10 * s, pairs, np.full(n, BENT / bending**2))


def names(curve: ForceCurve) -> list[str]:
    return [stage.name for stage in find_stages(curve, BENT)]


@pytest.mark.parametrize("n", [121, 601, 6001])
def test_stages_of_a_known_curve(n: int) -> None:
    curve = synthetic(n)
    stages = find_stages(curve, BENT)
    assert [stage.name for stage in stages] == ["initial deformation", "contact", "bending"]
    assert stages[0].travel == 0.0
    assert stages[1].travel == pytest.approx(CONTACT, abs=2e-5)
    assert stages[2].travel == pytest.approx(BENDING, abs=1e-9)
    for stage in stages:
        assert stage.force == pytest.approx(10 * stage.travel, abs=1e-9)


def test_contact_onset_of_a_hertz_force_lies_between_its_records() -> None:
    s = np.linspace(0, 0.06, 61)
    onset = first_touch(s, 1e4 * np.maximum(0, s - 0.0133)[:, None] ** 1.5)[0]
    assert onset is not None
    assert 0.013 <= onset <= 0.014
    assert onset == pytest.approx(0.0133, abs=4e-4)


def test_noise_below_the_threshold_is_no_contact() -> None:
    curve = synthetic(61)
    curve.pair_force[:, 0] = 1e-6
    assert find_stages(curve)[1].travel == pytest.approx(CONTACT, abs=2e-5)


def test_stages_come_in_the_order_in_which_they_are_reached() -> None:
    assert names(synthetic(601, 0.005)) == ["initial deformation", "bending", "contact"]
    assert names(synthetic(601, 1.0)) == ["initial deformation", "contact"]


def test_energy_of_the_start_is_not_counted() -> None:
    curve = synthetic(601)
    curve.panels[:] += 10.0 * BENT
    assert bending_onset(curve, BENT) == pytest.approx(BENDING, abs=1e-9)


def test_panels_that_bend_in_a_snap_bend_from_there() -> None:
    """Vibration above the limit at 8 to 9 mm is not reported as bending; the snap at 20 mm, after which the panels remain
    bent, is."""
    s = np.linspace(0, 0.06, 61)
    curve = curve_of(
        s, s, path=np.where(s < 0.0075, 0, np.where(s < 0.0095, 1, np.where(s < 0.0195, 2, np.where(s < 0.04, 3, 4))))
    )
    curve.panels[:] = np.where(curve.path == 1, 4.0, np.where(s < 0.0195, 0.0, 4.0)) * BENT
    assert bending_onset(curve, BENT) == pytest.approx(0.0195, abs=1e-9)


def test_bent_panel_of_a_case() -> None:
    """A moment M = E I phi/a at both ends bends a panel to an arc of phi; its work is M phi/2."""
    strip = {"length": 0.48, "panels": 6, "width": 0.04, "thickness": 3e-4}
    moment = 3e9 * 0.04 * 3e-4**3 / 12 * BEND / 0.08
    assert bent_energy({"strip": strip, "material": {"young": 3e9}}) == pytest.approx(0.5 * moment * BEND)
    assert bent_energy({"scene": {}}) is None


def test_one_point_that_leaps_is_not_bending() -> None:
    curve = synthetic(601)
    curve.panels[100] = 2.0 * BENT
    assert bending_onset(curve, BENT) == pytest.approx(BENDING, abs=1e-9)


def test_stages_not_reached_are_absent() -> None:
    s = np.linspace(0, 0.06, 61)
    assert names(curve_of(s, s, np.zeros((61, 0)))) == ["initial deformation"]
    assert names(curve_of(s, s, np.zeros((61, 2)))) == ["initial deformation"]
    assert find_stages(curve_of(s[:0], s[:0], np.zeros((0, 2)))) == []


def test_points_at_rest_after_the_drive_change_nothing() -> None:
    curve = synthetic(61)
    longer = ForceCurve(*(np.concatenate([values, values[-1:], values[-1:]]) for values in vars(curve).values()))
    assert find_stages(longer, BENT) == find_stages(curve, BENT)


def snapping() -> ForceCurve:
    """A path up to 1 N at 20 mm, where it snaps; a spike of 5 N in the motion after; then down from .8 N to -1.5 N."""
    s = np.linspace(0, 0.06, 61)
    force = np.where(s <= 0.02 + 1e-9, 50 * s, 0.8 - 2.3 * (s - 0.025) / 0.035)
    path = np.where(s <= 0.02 + 1e-9, 0, np.where(s < 0.025 - 1e-9, 1, 2))
    force[22], force[24] = 5.0, 0.2
    return curve_of(s, force, path=path)


def test_a_spike_in_a_snap_is_the_dynamic_peak_and_no_other() -> None:
    found = peaks(snapping())
    assert found.largest == pytest.approx((1.0, 0.02))  # no parabola through points that do not belong to the path
    assert found.dynamic == pytest.approx((5.0, 0.022), rel=0.2)
    assert found.magnitude == pytest.approx((1.5, 0.06))


def test_the_jerk_of_the_start_is_no_peak() -> None:
    curve = snapping()
    curve.force[1], curve.path[1:] = 100.0, curve.path[1:] + 2
    curve.path[1] = 1
    assert peaks(curve).largest == pytest.approx((1.0, 0.02))
    assert peaks(curve).dynamic == pytest.approx((5.0, 0.022), rel=0.2)


def test_dampers_at_the_start_of_a_motion_are_no_peak() -> None:
    """The force of dampers at the jerk of a drive grows as the steps decrease, accelerates little and stores little."""
    curve = snapping()
    curve.path[:] += 2
    curve.force[1] = 100.0
    assert peaks(curve).largest == pytest.approx((100.0, 0.001), rel=1e-3)  # of a path of equilibria
    curve.path[0] = 1
    summary = summarise(curve, [])
    assert (summary["peak_force"], summary["peak_travel"]) == pytest.approx((1.0, 0.02))
    assert (summary["start_up_force"], summary["start_up_travel"]) == pytest.approx((100.0, 0.001))


def test_a_run_without_quasi_static_points_has_its_dynamic_peak() -> None:
    curve = snapping()
    curve.path[1:] = 1
    summary = summarise(curve, [])
    assert summary["peak_kind"] == "dynamic"
    assert summary["peak_force"] == summary["dynamic_peak_force"] == pytest.approx(5.0, rel=0.2)


def test_thinned_curves_keep_peaks_and_ends() -> None:
    s = np.linspace(0, 0.06, 60001)
    path = np.where(s < 0.02, 0, np.where(s < 0.025, 1, 2))
    force = np.sin(400 * s) + 0.3 * np.sin(4e4 * s)
    curve = curve_of(s, force, path=path)
    thin = curve.decimate(500)
    assert len(thin) < 1000
    for dynamic in (False, True):
        kept, all_of_them = (one.force[one.dynamic == dynamic] for one in (thin, curve))
        assert (kept.max(), kept.min()) == (all_of_them.max(), all_of_them.min())
    assert (thin.time[0], thin.time[-1]) == (s[0], s[-1])
    assert np.array_equal(np.unique(thin.path), [0, 1, 2])


def test_summary() -> None:
    curve = synthetic(121)
    curve.force[:] = 2 - 3000 * (curve.travel - 0.03) ** 2
    summary = summarise(curve, ["1-2", "3-4"], BENT)
    assert summary["peak_force"] == pytest.approx(2.0, abs=1e-9)
    assert summary["peak_travel"] == pytest.approx(0.03, abs=1e-9)
    assert summary["final_travel"] == 0.06
    assert [stage["name"] for stage in summary["stages"]] == ["initial deformation", "contact", "bending"]
    assert summary["contact_travel"] == summary["stages"][1]["travel"]
    assert summary["bending_force"] == summary["stages"][2]["force"]
    assert [touch["pair"] for touch in summary["touches"]] == ["3-4"]
    assert summary["touches"][0]["travel"] == pytest.approx(CONTACT, abs=1e-6)


def test_sliding_distance_is_the_integral_of_the_slip() -> None:
    time = np.array([0.0, 0.1, 0.4, 1.0])
    slid = sliding_distance(time, np.column_stack([2.0 * time, np.ones(4)]))
    np.testing.assert_allclose(slid, np.column_stack([time**2, time]), atol=1e-15)  # a line is integrated exactly


def test_pairs_that_touch_are_those_of_first_touch() -> None:
    force = np.array([[0.0, 0.0, 0.0, 0.0], [5.0, 1e-6, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    assert touching_pairs(force) == [0, 3]
    assert [x is not None for x in first_touch([0.0, 1.0, 2.0], force)] == [True, False, False, True]
    assert touching_pairs(np.zeros((4, 2))) == []
    assert touching_pairs(np.zeros((4, 0))) == []


def contact_run(driven: bool) -> Solution:
    """Three pairs: one touches in a record, one only between records, one never."""
    force, gap = np.zeros((4, 3)), np.full((4, 3), 1e-3)
    force[2:, 0], gap[2:, 0] = (2.0, 1.0), (-3e-6, -2e-6)
    energy = np.cumsum(force, axis=0)
    records = [
        Record(
            time=0.5 * i, q=np.zeros(1), u=np.zeros(1), travel=np.array([0.01 * i])[: int(driven)],
            force=np.zeros(int(driven)), energy={}, pair_force=force[i], pair_gap=gap[i], pair_area=1e-4 * force[i],
            pair_friction=0.1 * force[i], pair_slip=force[i], pair_friction_power=force[i], pair_damping_power=force[i],
            pair_friction_energy=energy[i], pair_damping_energy=2 * energy[i], shape=np.zeros((0, 4, 3)),
        )
        for i in range(4)
    ]  # fmt: skip
    return Solution.from_records(records, Layout(pair_names=("a - b", "b - c", "c - d")))


def test_summary_of_contacts() -> None:
    looked_at = [[0.0, 0.0, 0.0], [2.5, 1.0, 0.0]]
    touches = [{"pair": "a - b", "travel": 0.012, "force": 1.0}, {"pair": "b - c", "travel": 0.015, "force": 1.0}]
    first, second = summarise_contacts(contact_run(True), looked_at, touches)
    assert first == {
        "pair": "a - b", "travel": 0.012, "largest_force": 2.5, "largest_penetration": 3e-6, "largest_area": 2e-4,
        "sliding_distance": pytest.approx(0.5 * 1.0 + 0.5 * 1.5), "friction_energy": 3.0, "damping_energy": 6.0,
    }  # fmt: skip
    assert second["pair"] == "b - c"
    assert (second["travel"], second["largest_force"], second["largest_penetration"]) == (0.015, 1.0, 0.0)


def test_summary_of_contacts_without_a_drive_has_their_time() -> None:
    (first,) = summarise_contacts(contact_run(False), [])
    assert first["time"] == 1.0
    assert "travel" not in first


def test_a_peak_early_in_a_long_travel_is_that_of_the_points_beside_it() -> None:
    """A panel that buckles within micrometres of 10 mm: points farther away have no information on its peak."""
    travel = np.concatenate([np.linspace(0.0, 1e-5, 201), np.linspace(1.1e-5, 1e-2, 400)])
    since = np.maximum(travel - 1.5e-6, 0.0) / 5e-7
    force = 270.0 * since * np.exp(1.0 - since)
    found, at = peak(travel, force)
    assert force.max() <= found < 1.001 * force.max()
    assert at == pytest.approx(2e-6, abs=5e-8)
