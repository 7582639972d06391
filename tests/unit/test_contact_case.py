"""Sections [contact] and [friction] of a case: the selected law, its needed keys, refused keys, and the written text."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from fsm.case.loading.load_case import read_case
from fsm.case.loading.toml_text import case_text
from fsm.case.models.contact import FRICTION_KEYS, NORMAL_KEYS, Contact, Friction, hertz_stiffness
from fsm.errors import CaseError
from fsm.laws.friction import FRICTION_LAWS
from fsm.laws.normal import NORMAL_LAWS

CASE: dict[str, Any] = {
    "strip": {"length": "480 mm", "width": "40 mm", "thickness": "0.3 mm", "panels": 6, "fold_angle": "80 deg"},
    "material": {"young": "3 GPa", "density": "800 kg/m^3"},
    "crease": {"law": "linear", "stiffness": "9 N mm/rad"},
    "drive": [{"crease": 3, "speed": "2 mm/s", "travel": "100 mm"}],
}
K = {"stiffness": 5.0}
MU = {"mu_static": 0.3, "mu_dynamic": 0.2}


def read(contact: Any, friction: Any = None, units: str = "SI") -> tuple[Any, list[str]]:
    data = CASE | {"units": units, "contact": contact} | ({"friction": friction} if friction is not None else {})
    case, faults = read_case(data, Path())
    return case, [str(fault) for fault in faults]


def test_every_law_can_be_named() -> None:
    assert list(NORMAL_LAWS) == list(NORMAL_KEYS)
    assert list(FRICTION_LAWS) == list(FRICTION_KEYS)
    for model, laws in ((Contact, NORMAL_KEYS), (Friction, FRICTION_KEYS)):
        for keys in laws.values():
            assert set(keys.needed + keys.optional) <= set(model.model_fields)
            assert not set(keys.needed) & set(keys.optional)


@pytest.mark.parametrize(
    ("contact", "law"),
    [
        (K, "hertz"),
        (K | {"damping": 3.0}, "hertz"),
        (K | {"restitution": 0.5}, "restitution"),
        (K | {"restitution": 0.5, "law": "flores"}, "flores"),
    ],
)
def test_which_law_is_meant(contact: dict[str, Any], law: str) -> None:
    assert Contact.model_validate(contact).law == law
    assert read(contact)[0].contact.law == law


def test_sections_as_before() -> None:
    contact = Contact(stiffness=1e9)
    assert (contact.exponent, contact.damping, contact.ramp, contact.speed_floor) == (1.5, 0.0, 1e-5, 1e-3)
    friction = Friction(**MU, v_static=1e-3, v_dynamic=1e-2)
    assert friction.law == "step"


def test_linear_law_has_the_exponent_one() -> None:
    case, _ = read({"law": "linear", "stiffness": 5, "ramp": 0.001}, units="mm-N-s")
    assert (case.contact.exponent, case.contact.stiffness, case.contact.ramp) == pytest.approx((1.0, 5e3, 1e-6))
    assert read({"law": "linear", "stiffness": "5 N/mm"})[0].contact.stiffness == pytest.approx(5e3)


def test_stiffness_from_material() -> None:
    """A steel ball of 10 mm radius on a flat face of steel, and two balls of different materials."""
    case, faults = read({"young": "210 GPa", "poisson": 0.3, "radius": "10 mm"})
    assert not faults
    assert case.contact.stiffness == pytest.approx(4 / 3 * 210e9 / (2 * 0.91) * 0.1, rel=1e-14)
    case, _ = read({"young": [3000, 200], "poisson": [0.3, 0.45], "radius": [10, 40], "restitution": 0.7}, units="mm-N-s")
    modulus = 1 / ((1 - 0.09) / 3e9 + (1 - 0.45**2) / 0.2e9)
    assert case.contact.stiffness == pytest.approx(4 / 3 * modulus * 0.008**0.5, rel=1e-14)
    assert hertz_stiffness([1e9], [0.0], [1.0]) == pytest.approx(2 / 3 * 1e9)


SECTIONS = [
    (K, None),
    ({"law": "impact", "stiffness": 5, "damping": 3, "ramp": "10 um"}, {"law": "tanh", "mu_dynamic": 0.2, "v_static": 1e-3}),
    ({"law": "linear", "stiffness": 5}, {**MU, "v_static": 1e-3, "v_dynamic": 2e-3}),
    ({"stiffness": 5, "restitution": 0.4}, {"law": "stribeck", **MU, "v_static": 1e-3, "v_stribeck": 2e-3}),
    (
        {"young": [3e9, 2e9], "poisson": 0.3, "radius": 1.1e-3, "restitution": 0.4, "law": "hunt-crossley"},
        {"law": "lugre", **MU, "v_stribeck": 2e-3, "presliding": 1e-5},
    ),
]


@pytest.mark.parametrize("units", ["SI", "mm-N-s"])
@pytest.mark.parametrize(("contact", "friction"), SECTIONS, ids=["hertz", "impact", "linear", "restitution", "material"])
def test_what_is_written_reads_the_same(contact: dict[str, Any], friction: dict[str, Any] | None, units: str) -> None:
    case, faults = read(contact, friction, units)
    assert not faults
    text = case_text(case)
    again, faults = read_case(tomllib.loads(text), Path())
    assert not faults and again is not None
    assert again.contact == case.contact and again.friction == case.friction
    assert case_text(again) == text
    written = tomllib.loads(text)["contact"]
    assert ("stiffness" in written) != ("young" in written)
    assert ("damping" in written) == (case.contact.law in ("hertz", "impact", "linear"))


ONE_FAULT: list[tuple[dict[str, Any], dict[str, Any] | None, str]] = [
    ({"stifness": 1}, None, "contact.stifness: unknown key; did you mean `stiffness`?"),
    ({"law": "impact", "damping": 3, **K}, None, "contact.ramp: missing; give a value in m"),
    ({"law": "impact", "dampng": 3, "ramp": 1, **K}, None, "contact.dampng: unknown key; did you mean `damping`?"),
    ({"law": "flores", **K}, None, "contact.restitution: missing; this key is required"),
    ({"law": "linear", "stiffness": -5}, None, "contact.stiffness: must be greater than 0; it is -5 N/m"),
    ({"law": "linear", "stiffness": 5, "exponent": 1.5}, None, 'contact: law = "linear" requires the exponent 1; it is 1.5'),
    (
        {"law": "hertz", "restitution": 0.5, **K},
        None,
        'contact.restitution: not used with law = "hertz", only with "hunt-crossley", "lankarani-nikravesh", "flores" or '
        '"restitution"; remove this key',
    ),
    (
        {"restitution": 0.5, "damping": 3, **K},
        None,
        'contact.damping: not used with law = "restitution", only with "hertz", "impact" or "linear"; remove this key',
    ),
    (
        {"restitution": 0, **K},
        None,
        "contact.restitution: must be above 0 and at most 1; it is 0; a value of 0 needs infinite damping",
    ),
    ({"restitution": 1.2, **K}, None, "contact.restitution: must be above 0 and at most 1; it is 1.2"),
    ({"restitution": 0.5, "speed_floor": 0, **K}, None, "contact.speed_floor: must be greater than 0; it is 0 m/s"),
    ({"young": 3e9, "radius": 1e-3}, None, "contact.poisson: missing"),
    ({"young": -3e9, "poisson": 0.3, "radius": 1e-3}, None, "contact.young: must be greater than 0; it is -3000000000.0 Pa"),
    ({"young": [3e9, 0], "poisson": 0.3, "radius": 1}, None, "contact.young.1: must be greater than 0; it is 0 Pa"),
    ({"young": [], "poisson": 0.3, "radius": 1}, None, "contact.young: has no value; give one value"),
    ({"young": 3e9, "poisson": 0.3, "radius": [1, 2, 3]}, None, "contact.radius: must have 2 values, not 3"),
    (
        {"young": 3e9, "poisson": 0.3, "radius": 1e-3, **K},
        None,
        "contact.stiffness: is given together with `young`, `poisson` or `radius` of Hertz' formula; remove one of the two",
    ),
    (
        {"young": 3e9, "poisson": 0.3, "radius": 1e-3, "exponent": 2},
        None,
        "contact.stiffness: Hertz' formula requires the exponent 1.5; the exponent is 2; give `stiffness`",
    ),
    (K, {"mu_dynamic": 0.2, "v_static": 1, "v_dynamic": 2}, "friction.mu_static: missing"),
    (K, {**MU, "v_static": 1}, "friction.v_dynamic: missing; give a value in m/s"),
    (
        K,
        {"law": "tanh", **MU, "v_static": 1},
        'friction.mu_static: not used with law = "tanh", only with "step", "stribeck" or "lugre"; remove this key',
    ),
    (
        K,
        {"mu_static": 0.1, "mu_dynamic": 0.2, "v_static": 1, "v_dynamic": 2},
        'friction: law "step" needs mu_static >= mu_dynamic; mu_static = 0.1, mu_dynamic = 0.2',
    ),
    (
        K,
        {**MU, "v_static": 1, "v_dynamic": 1},
        'friction: law "step" needs v_dynamic greater than v_static; v_dynamic = 1 m/s, v_static = 1 m/s',
    ),
    (
        K,
        {"law": "stribeck", **MU, "v_static": 2, "v_stribeck": 1},
        'friction: law "stribeck" needs v_stribeck greater than v_static; v_stribeck = 1 m/s, v_static = 2 m/s',
    ),
    (K, {"law": "lugre", **MU, "v_stribeck": 1}, "friction.presliding: missing; give a value in m"),
    (
        K,
        {"law": "lugre", **MU, "v_stribeck": 1, "presliding": 1, "v_static": 1},
        'friction.v_static: not used with law = "lugre", only with "step", "tanh" or "stribeck"; remove this key',
    ),
    (
        K,
        {"law": "lugre", "mu_static": 0.3, "mu_dynamic": 0, "v_stribeck": 1, "presliding": 1},
        'friction: law "lugre" needs mu_dynamic > 0',
    ),
    (
        K,
        {"law": "lugre", **MU, "v_stribeck": 1, "presliding": 1, "bristle_damping": 2},
        "friction: bristle_damping = 2 s/m would generate energy; it must be at most 9.3 mu_dynamic/v_stribeck = 1.86 s/m",
    ),
    (
        K,
        {"law": "lugre", **MU, "v_stribeck": 1, "presliding": 1, "viscous": "2 m/s"},
        'friction.viscous: "2 m/s" has the wrong unit; give a value in s/m',
    ),
    (K, {"law": "tanh", "mu_dynamic": 0.2, "v_static": 1, "across": 0}, "friction.across: "),
]


@pytest.mark.parametrize(("contact", "friction", "line"), ONE_FAULT, ids=[line[2][:60] for line in ONE_FAULT])
def test_one_mistake_is_one_line(contact: dict[str, Any], friction: dict[str, Any] | None, line: str) -> None:
    case, faults = read(contact, friction)
    assert case is None
    assert len(faults) == 1, faults
    assert faults[0].startswith(line)


def test_the_same_is_refused_in_python() -> None:
    with pytest.raises(CaseError, match="not used with law"):
        Contact(stiffness=1.0, law="hertz", restitution=0.5)
    with pytest.raises(CaseError, match="presliding: missing; give a value in m"):
        Friction(law="lugre", mu_static=0.3, mu_dynamic=0.2, v_stribeck=1.0)


def test_no_compiler_is_needed_to_read_laws() -> None:
    program = "import sys, fsm.case.loading.load_case; sys.exit(any(name in sys.modules for name in ('numba', 'fsm.laws')))"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_pairs_of_panels_are_not_read_beside_a_scene() -> None:
    """They were omitted without a message."""
    data = tomllib.loads((Path(__file__).parents[2] / "folding_cases" / "dropped_plates" / "case.toml").read_text())
    assert read_case(data, Path())[1] == []
    data["contact"]["pairs"] = [[1, 2]]
    assert [str(fault) for fault in read_case(data, Path())[1]] == [
        "contact.pairs: only a [strip] has panel numbers; give the pairs of a [scene] as `scene.pairs`"
    ]
