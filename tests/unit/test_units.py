"""Numbers with units: every accepted and refused notation, and the two unit systems."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from fsm.case.models.contact import Contact
from fsm.case.models.materials import Material
from fsm.case.models.scene import ForceElement
from fsm.case.schema.units import UNITS, AngularStiffness, Count, parse_unit, to_si, unit_in


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        ("80 deg", "rad", math.radians(80)),
        ("1.5e1°", "rad", math.radians(15)),
        ("2 mm/s", "m/s", 2e-3),
        ("9 N mm/rad", "N m/rad", 9e-3),
        ("9 Nm", "N m", 9.0),
        ("9 Nmm/rad", "N m/rad", 9e-3),
        ("9 mNm", "N m", 9e-3),
        ("5 Ns/m", "N s/m", 5.0),
        ("2 kNm^2", "N m^2", 2e3),
        ("9 N m", "N m/rad", 9.0),  # radians left out
        ("1 N m/deg", "N m/rad", 180 / math.pi),
        ("3 GPa", "Pa", 3e9),
        ("1 kgf/cm^2", "Pa", 98066.5),
        ("1 psi", "Pa", 0.45359237 * 9.80665 / 0.0254**2),
        ("1 lbf", "N", 0.45359237 * 9.80665),
        ("800 kg/m^3", "kg/m^3", 800.0),
        ("800 kg/m3", "kg/m^3", 800.0),
        ("0.8 g/cm³", "kg/m^3", 800.0),
        ("1 J/s/W", "", None),
        ("1e9 N/m^1.5", "N/m^1.5", 1e9),
        ("1 N/mm^1.5", "N/m^1.5", 1000.0**1.5),
        ("1 N s/mm", "N s/m", 1e3),
        ("2 N*mm", "N m", 2e-3),
        ("2 N·mm", "N m", 2e-3),
        ("25 μm", "m", 25e-6),
        ("25 µm", "m", 25e-6),
        ("1 1/s", "s^-1", 1.0),
        ("30 %", "", 0.3),
        ("-.5", "m", -0.5),
        (3, "m", 3.0),
    ],
)
def test_value_in_si(value, unit, expected):
    if expected is None:
        with pytest.raises(ValueError, match="unknown unit 'W'"):
            to_si(value, unit)
    else:
        assert to_si(value, unit) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        ("40 kg", "m", '"40 kg" has the wrong unit; give a value in m'),
        ("3 mpa", "Pa", "did you mean `MPa`"),
        ("3 Furlong", "m", "unknown unit 'Furlong'"),
        ("wide", "m", '"wide" is not a number; give a value in m'),
        ("1 m /", "m", "a factor is missing beside the /"),
        ("80 deg", "", "give a plain number"),
        (True, "m", "true is not a number"),
        ([1], "m", "is not a number"),
        (None, "m", "is not a number"),
        (math.nan, "m", "nan is not a finite number"),
        (-math.inf, "m", "-inf is not a finite number"),
        ("1e999 mm", "m", "1e999 mm is not a finite number"),
        (10**400, "m", "too many digits"),
        (1e300, "s", "1e+300 is outside 1e-60 to 1e+60 in SI; give a value in s"),
        ("1e-200 mm", "m", "is outside 1e-60 to 1e+60"),
        ("1 " + "m" * 10**6, "m", "has more than 100 characters"),
        ("5 Hz", "rad/s", "may mean turns or radians"),
    ],
)
def test_refusal_says_what_is_wanted(value, unit, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        to_si(value, unit)


@pytest.mark.parametrize(
    ("unit", "name", "scale"),
    [
        ("m", "mm", 1e-3),
        ("kg", "t", 1e3),
        ("Pa", "MPa", 1e6),
        ("N m/rad", "N mm/rad", 1e-3),
        ("kg/m^3", "t/mm^3", 1e12),
        ("N s/m", "N s/mm", 1e3),
        ("N/m^1.5", "N/mm^1.5", 1000.0**1.5),
        ("kg m^2", "t mm^2", 1e-3),
        ("m/s^2", "mm/s^2", 1e-3),
        ("rad", "rad", 1.0),
    ],
)
def test_plain_numbers_in_millimetres(unit, name, scale):
    assert unit_in(unit, "mm-N-s") == name
    assert unit_in(unit, "SI") == unit
    assert to_si(1, unit, "mm-N-s") == pytest.approx(scale, rel=1e-12)
    assert to_si(f"1 {name}", unit) == pytest.approx(scale, rel=1e-12)


@given(st.floats(allow_nan=False, allow_infinity=False, width=32), st.sampled_from(sorted(UNITS)))
def test_text_and_number_agree(value, name):
    scale, _ = parse_unit(name)
    assert to_si(f"{value!r} {name}", name) == value * scale


@given(st.text(max_size=12))
def test_any_text_is_a_number_or_a_plain_refusal(text):
    try:
        value, words = to_si(text, "m"), ""
    except ValueError as error:
        value, words = 0.0, str(error)
    assert math.isfinite(value)
    assert not words or "give a" in words


def test_defaults_are_si_in_every_unit_system():
    contact = TypeAdapter(Contact).validate_python({"stiffness": 1}, context={"units": "mm-N-s"})
    assert contact.ramp == Contact(stiffness=1).ramp == 1e-5
    material = TypeAdapter(Material).validate_python(
        {"young": 3000, "density": 8e-10}, context={"units": "mm-N-s"}
    )
    assert material.young == pytest.approx(3e9)
    assert material.density == pytest.approx(800)
    assert material.damping is None  # a strip takes it from the time of its drive


def test_contact_stiffness_goes_with_its_exponent():
    def read(units="SI", **keys):
        return TypeAdapter(Contact).validate_python(keys, context={"units": units}).stiffness

    assert read(stiffness="1e9 N/m^1.5") == 1e9
    assert read(exponent=1.2, stiffness="1 kN/mm^1.2") == pytest.approx(1e3 * 1e3**1.2)
    assert read("mm-N-s", exponent=2, stiffness=5) == pytest.approx(5e6)
    with pytest.raises(ValidationError, match=r"give a value in N/m\^1\.5"):
        read(stiffness="1e9 N/m")
    with pytest.raises(ValidationError, match=r"give a value in N/m\^2"):
        read(exponent=2, stiffness="1e9 N/m^1.5")


def test_true_is_no_count_and_missing_radians_are_allowed():
    assert TypeAdapter(Count).validate_python(6.0) == 6
    with pytest.raises(ValidationError):
        TypeAdapter(Count).validate_python(True)
    assert TypeAdapter(AngularStiffness).validate_python("9 N mm") == pytest.approx(9e-3)


@pytest.mark.parametrize(
    ("text", "unit", "hint"),
    [
        ("9 N.m", "N m", "did you mean `N m`?"),
        ("9 N-mm", "N m", "did you mean `N mm`?"),
        ("9 kgm^2", "kg m^2", "did you mean `kg m^2`?"),
        ("5 sec", "s", "did you mean `s`?"),
        ("5 gpa", "Pa", "did you mean `GPa`?"),
        ("0,1 kg", "kg", '"0,1 kg" has a comma; write "0.1 kg" with a decimal point;'),
        ("1,000 mm", "m", 'write "1.000 mm" with a decimal point, or "1000 mm" for thousands;'),
        ("1,000.5 mm", "m", "write a decimal point and no other separators;"),
        ("1 000 mm", "m", "has a blank within the number;"),
        ("50 %", "rad", '"50 %" is a percentage; give a value in rad'),
        ("5 N %", "N", "is a percentage"),
    ],
)
def test_what_was_probably_meant(text: str, unit: str, hint: str) -> None:
    with pytest.raises(ValueError, match=re.escape(hint)):
        to_si(text, unit)


def test_a_blank_before_a_unit_that_begins_with_one_is_no_mistake() -> None:
    assert to_si("5 1/s", "1/s") == 5.0
    assert to_si("30 %", "") == pytest.approx(0.3)


def test_flexibility_of_half_segments_has_a_unit() -> None:
    """A plain number is in the unit system of the file, 1 rad/(N mm) = 1000 rad/(N m)."""
    words = {"name": "hinge", "inner": "a", "outer": "ground"}
    plain, text = (
        ForceElement.model_validate({**words, "crease_flexibility": value}, context={"units": "mm-N-s"}).crease_flexibility
        for value in (2, "2e3 rad/N/m")
    )
    assert plain == text == 2e3
