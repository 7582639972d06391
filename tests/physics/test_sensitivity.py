"""Derivatives of equilibria against central differences of whole solves."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest

from fsm.calibrate.response import Response, force_response, peak_of, peak_response
from fsm.calibrate.sensitivity import VariedParameter, vary_parameters
from fsm.calibrate.study import value_at, with_values
from fsm.case.models.case import Case
from fsm.errors import CaseError

STRIP = {
    "strip": {"length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": 1.4, "segments_per_panel": 4},
    "material": {"young": 3e9, "density": 800.0, "damping": 0.0},
    "crease": {"law": "linear", "stiffness": 9e-3},
    "contact": {"law": "hertz", "exponent": 1.5, "stiffness": 1e9, "thickness_in_gap": False, "pairs": [[3, 4]]},
    "drive": [{"crease": 3, "speed": 2e-3, "travel": 0.04}],
    "solve": {"method": "static", "rtol": 1e-6},
}
FRICTION = {"law": "step", "mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 1e-3, "v_dynamic": 1e-2}
TRAVEL = np.linspace(0.0, 0.04, 81)
PATHS = ["material.young", "crease.stiffness", "contact.stiffness", "strip.thickness", "strip.width", "strip.fold_angle"]


def strip(**material: float) -> Case:
    return Case.model_validate({**STRIP, "material": {**STRIP["material"], **material}})  # type: ignore[dict-item]


def squares(**changes: object) -> Case:
    lattice = {
        "columns": 2, "rows": 3, "spacing": 0.015, "hinge_length": 0.00225, "angle": "20 deg", "axial": 4e4,
        "shear": 1500.0, "rotational": 1.2e-3, "depth": 0.01, "density": 1200.0, **changes,
    }  # fmt: skip
    drive = {"edge": "top", "direction": [0.3, 0, 1], "speed": 1e-4, "travel": 1e-3}
    return Case.model_validate({"lattice": lattice, "drive": [drive], "solve": {"method": "static", "rtol": 1e-8}})


def differences(case: Case, travel: np.ndarray, path: str, part: float) -> tuple[float, np.ndarray]:
    """d(peak)/d(log p) and d(force)/d(log p), central differences of two sizes and Richardson's step."""
    value, peaks, forces = value_at(case, path), [], []
    for size in (part, 0.5 * part):
        ends = [force_response(with_values(case, {path: value * (1.0 + sign * size)}), travel) for sign in (1.0, -1.0)]
        peaks.append((peak_of(ends[0]).force - peak_of(ends[1]).force) / (2.0 * size))
        forces.append((ends[0].force - ends[1].force) / (2.0 * size))
    return (4.0 * peaks[1] - peaks[0]) / 3.0, (4.0 * forces[1] - forces[0]) / 3.0


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_curve_of_a_lattice(damping: float) -> None:
    case, travel = squares(damping=damping), np.linspace(1e-4, 1e-3, 10)
    paths = [f"lattice.{name}" for name in ("axial", "shear", "rotational", "angle", "hinge_length", "spacing")]
    paths += ["lattice.damping"] if damping else []
    case = case.model_copy(update={"solve": case.solve.model_copy(update={"max_step": 0.05})})
    found = force_response(case, travel, paths)
    assert found.jacobian is not None
    for column, path in zip(found.jacobian.T, paths, strict=True):
        _, wanted = differences(case, travel, path, 1e-3)
        # with dampers the force depends on the steps; first they follow the parameter, and later they are the longest
        # allowed
        late = slice(6 if damping else 0, None)
        found_there, bound = column[late] * value_at(case, path), 1e-5 * np.abs(wanted).max()
        np.testing.assert_allclose(found_there, wanted[late], atol=bound, err_msg=path)


def _central(*arguments: Any, central: bool) -> list[VariedParameter]:
    return vary_parameters(*arguments, central=True)


def test_adjoint_is_forward(monkeypatch: pytest.MonkeyPatch) -> None:
    paths = ["lattice.axial", "lattice.shear", "lattice.angle"]

    def both(travel: float) -> list[np.ndarray | None]:
        ways: tuple[Literal["forward", "adjoint"], ...] = "forward", "adjoint"
        return [force_response(squares(), np.array([travel]), paths, way).jacobian for way in ways]

    np.testing.assert_allclose(*both(1e-3), rtol=1e-5)  # the accuracy of both
    monkeypatch.setattr("fsm.calibrate.response.vary_parameters", _central)
    monkeypatch.setattr("fsm.calibrate.sensitivity._MOST", 1)  # the same partial derivatives
    for travel in (1e-4, 4e-4, 7e-4, 1e-3):
        np.testing.assert_allclose(*both(travel), rtol=1e-9)
    with pytest.raises(CaseError, match="depend on the previous state"):
        force_response(squares(damping=0.1), np.array([1e-3]), paths, "adjoint")


def test_gradient_of_the_peak_of_a_strip_with_contact() -> None:
    peak = peak_response(strip(), TRAVEL, PATHS)
    assert peak.gradient is not None
    for slope, path in zip(peak.gradient, PATHS, strict=True):
        # a change of a length or an angle must not open contacts, so it is 1e-5; the contact stiffness hardly affects the
        # force, and with small changes of it half of the differences is round-off
        part = 1e-5 if path.endswith("angle") else 1e-2 if path == "contact.stiffness" else 1e-3
        wanted, _ = differences(strip(), TRAVEL, path, part)
        tolerance = 1e-5 if path != "contact.stiffness" else 1e-3
        assert slope * value_at(strip(), path) == pytest.approx(wanted, rel=tolerance), path


def test_gradient_with_dampers_and_friction() -> None:
    tables = {**STRIP, "friction": FRICTION, "material": {**STRIP["material"], "damping": 0.01}}  # type: ignore[dict-item]
    tables["contact"] = {**STRIP["contact"], "stiffness": 8e10, "damping": 10.0}  # type: ignore[dict-item]
    tables["strip"] = {**STRIP["strip"], "segments_per_panel": 10}  # type: ignore[dict-item]
    case = Case.model_validate({**tables, "solve": {"method": "static", "rtol": 1e-4}})  # all steps are those of the travels
    peak = peak_response(case, TRAVEL, ["strip.fold_angle", "strip.thickness"])
    assert peak.gradient is not None
    for slope, path in zip(peak.gradient, ("strip.fold_angle", "strip.thickness"), strict=True):
        wanted, _ = differences(case, TRAVEL, path, 1e-4)
        assert slope * value_at(case, path) == pytest.approx(wanted, rel=1e-5), path


def test_a_number_that_adds_dampers_is_refused() -> None:
    with pytest.raises(CaseError, match=r"material.damping: is 0; a small change adds dampers"):
        peak_response(strip(), TRAVEL[:5], ["material.damping"])


def test_rates_are_carried_along() -> None:
    case = strip(damping=0.1)
    peak = peak_response(case, TRAVEL, ["material.young", "material.damping"])
    whole = peak_of(force_response(case, TRAVEL, ["material.young", "material.damping"]))
    assert peak.gradient is not None and whole.gradient is not None
    # the derivatives start a few states before the peak: the omitted part is 1e-10 of the largest derivative, which is not
    # that of the damping
    np.testing.assert_allclose(peak.gradient, whole.gradient, rtol=1e-6)
    assert peak.gradient[1] * 0.1 > 1e-3  # N: the damping has an effect


def test_gradient_of_a_parabola_is_that_of_its_top() -> None:
    travel = np.array([0.0, 1.0, 2.5, 4.0])

    def force(height: float, place: float) -> np.ndarray:
        return np.asarray(height - 0.3 * (travel - place) ** 2)

    jacobian = np.column_stack([np.ones(4), 0.6 * (travel - 2.2)])
    peak = peak_of(Response(travel, force(3.0, 2.2), jacobian))
    assert (peak.force, peak.travel) == pytest.approx((3.0, 2.2))
    assert peak.gradient == pytest.approx([1.0, 0.0], abs=1e-12)


def test_an_end_is_a_peak_without_neighbours() -> None:
    peak = peak_of(Response(np.arange(3.0), np.array([0.0, 1.0, 2.0]), np.array([[1.0], [2.0], [3.0]])))
    assert (peak.force, peak.travel, peak.gradient) == (2.0, 2.0, pytest.approx([3.0]))


def test_travels_out_of_range_and_other_methods_are_refused() -> None:
    with pytest.raises(CaseError, match="the drive ends at 1 mm"):
        force_response(squares(), np.array([1e-4, 2e-3]))
    dynamic = squares().model_copy(update={"solve": squares().solve.model_copy(update={"method": "Radau"})})
    with pytest.raises(CaseError, match="quasi-static"):
        force_response(dynamic, np.array([1e-4]))
    crease = {"law": "spline", "angle": [-1.0, 0.0, 3.0], "moment": [-0.01, 0.0, 0.03], "unloading": [-0.01, -0.002, 0.03]}
    with pytest.raises(CaseError, match="because of their memory"):
        force_response(Case.model_validate({**STRIP, "crease": crease}), TRAVEL, ["crease.scale"])
    with pytest.raises(CaseError, match="no force to compare"):
        force_response(squares().model_copy(update={"drive": ()}), np.array([1e-4]))
