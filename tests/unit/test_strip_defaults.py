"""Defaults of a strip: contact stiffness from the material, dampers from the duration of the drive."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsm.builders.strip import build_strip, strip_damping
from fsm.case.loading.load_case import read_case
from fsm.case.models.case import Case
from fsm.errors import CaseError

BASE = {
    "strip": {"length": 0.48, "width": 0.04, "thickness": 3e-4, "panels": 6, "fold_angle": 1.4, "segments_per_panel": 2},
    "material": {"young": 3e9, "density": 800},
    "crease": {"law": "linear", "stiffness": 9e-3},
    "contact": {"thickness_in_gap": False},
    "drive": [{"crease": 3, "speed": 2e-3, "travel": 0.04}],
}


def read(**changes: object) -> Case:
    data = {key: value for key, value in {**BASE, **changes}.items() if value is not None}
    case, faults = read_case(data, Path())
    if case is None:
        raise CaseError(faults, "")
    return case


def test_contact_stiffness_from_the_material() -> None:
    """K d^e = 4000 EI/a^2 at a depth of 2e-5 a, or t/100 if that is less, whatever the law and the units."""
    force = 4000 * 2.7e-4 / 0.08**2
    assert read().contact.stiffness == pytest.approx(force / 1.6e-6**1.5, rel=1e-2)
    assert Case(**BASE).contact.stiffness == read().contact.stiffness  # type: ignore[arg-type]
    assert read(contact={"law": "linear"}).contact.stiffness == pytest.approx(force / 1.6e-6, rel=1e-2)
    assert read(contact={"exponent": 2}).contact.stiffness == pytest.approx(force / 1.6e-6**2, rel=1e-2)
    thin = read(strip={**BASE["strip"], "thickness": 3e-5})
    assert thin.contact.stiffness == pytest.approx(1e-3 * force / 3e-7**1.5, rel=1e-2)
    plain = {"length": 480, "width": 40, "thickness": 0.3, "panels": 6, "fold_angle": 1.4}
    sheet = {"young": 3e3, "density": 8e-10}
    in_millimetres = read(units="mm-N-s", strip=plain, material=sheet, crease={"law": "linear", "stiffness": 9.0})
    assert in_millimetres.contact.stiffness == pytest.approx(read().contact.stiffness, rel=1e-9)


def test_contact_stiffness_that_is_given_stays() -> None:
    assert read(contact={"stiffness": 1e9}).contact.stiffness == 1e9
    ball = {"young": 1e9, "poisson": 0.3, "radius": 0.01}
    assert read(contact=ball).contact.stiffness < 1e9


def test_only_a_strip_has_a_material_to_take_it_from() -> None:
    scene = {"bodies": [{"name": "one", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}]}
    _, faults = read_case({"scene": scene, "contact": {}, "solve": {"end_time": 1.0}}, Path())
    assert [str(fault) for fault in faults] == ["contact.stiffness: missing; give a value in N/m^1.5"]


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"contact": {"exponent": 7}}, "contact.exponent: must be at most 3"),
        ({"strip": {**BASE["strip"], "length": -1}}, "strip.length: must be greater than 0"),
        ({"material": None}, "material"),
    ],
)
def test_one_fault_is_one_line(changes: dict[str, object], fault: str) -> None:
    with pytest.raises(CaseError) as caught:
        read(**changes)
    assert len(caught.value.faults) == 1
    assert fault in str(caught.value)


@pytest.mark.parametrize(
    ("material", "speed", "method", "damping"),
    [
        ({}, 1e-3, "auto", 1e-3),  # 40 s
        ({}, 8e-3, "static", 2.5e-4),  # 5 s
        ({}, 8e-3, "generalized-alpha", 1e-3),
        ({}, 1.0, "auto", 1e-3),  # fast: dynamics
        ({"damping": 0.01}, 8e-3, "static", 0.01),
    ],
)
def test_damping_by_the_time_of_the_drive(
    material: dict[str, float], speed: float, method: str, damping: float
) -> None:
    drive = [{"crease": 3, "speed": speed, "travel": 0.04}]
    case = read(material={**BASE["material"], **material}, drive=drive, solve={"method": method})
    scene = build_strip(case)
    assert strip_damping(case, scene) == pytest.approx(damping)
    joint = scene.elements[0]
    assert joint.rotation_damping[1] == pytest.approx(damping * joint.rotation[1])
