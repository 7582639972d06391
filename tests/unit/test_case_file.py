"""Case files: accepted keys, units and overrides, and the text that reproduces the case."""

import math
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from fsm.case.loading.load_case import load_case
from fsm.case.models.case import Case, root
from fsm.case.models.materials import LinearCrease, SplineCrease
from fsm.case.schema.schema import locate
from fsm.errors import CaseError
from tests.case_texts import strip

CASE = f"""
title = "a strip, 80°, \\"low\\""
{strip()}[contact]
stiffness = "1e9 N/m^1.5"
[[drive]]
crease = 3
speed = "2 mm/s"
travel = "150 mm"
[expect]
peak_force = {{ value = 1.99, rtol = 0.02 }}
"""

MILLIMETRES = """
units = "mm-N-s"
[strip]
length = 480
width = 40
thickness = 0.3
panels = 6
fold_angle = 1.3962634015954636
[material]
young = 3000
density = "800 kg/m^3"
[crease]
stiffness = 9
law = "linear"
[contact]
stiffness = 31622.776601683792
[[drive]]
crease = 3
speed = 2
travel = 150
"""

SCENE = """
units = "mm-N-s"
[solve]
end_time = 1
[scene]
gravity = [0, 0, -9810]
[[scene.bodies]]
name = "a"
mass = "2 g"
inertia = ["1 g mm^2", "1 g mm^2", "1 g mm^2"]
plate = { length = 10, width = 5, thickness = 1 }
[[scene.bodies]]
name = "b"
mass = 1e-6
inertia = [1, 1, 1]
held = true
[[scene.elements]]
name = "hinge"
inner = "a"
outer = "b"
point_inner = [5, 0, 0]
crease = { law = "spline", angle = ["0 deg", "90 deg"], moment = [0, 9], interpolation = "pchip" }
[[load]]
body = "a"
force = ["1 mN", 0, 0]
time = { kind = "ramp", end = "100 ms" }
"""

# origami hinge on a rheometer (vishaal-krishnan/hinge_origami, Apache-2.0), mN m, every 10 degrees from -130 to 150
TORQUE = (
    -8.48, -8.236, -7.93, -7.58, -7.168, -6.658, -6.082, -5.475, -4.906, -4.269, -3.642, -3.036, -2.465, -1.943, -1.472,
    -1.09, -0.719, -0.393, -0.101, 0.144, 0.368, 0.577, 0.772, 0.961, 1.133, 1.296, 1.45, 1.612, 1.783,
)  # fmt: skip


def write(folder: Path, text: str, name: str = "case.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def faults(path, *overrides) -> dict[str, str]:
    with pytest.raises(CaseError) as caught:
        load_case(path, overrides)
    assert caught.value.source == str(path)
    return {fault.path: fault.message for fault in caught.value.faults}


def test_a_case_is_read_in_si(tmp_path):
    loaded = load_case(write(tmp_path, CASE))
    case = loaded.case
    assert case.strip is not None
    assert case.strip.fold_angle == pytest.approx(math.radians(80))
    assert case.drive[0].speed == 2e-3
    assert case.drive[0].travel == 0.15
    assert case.expect["peak_force"].rtol == 0.02
    assert loaded.path == tmp_path / "case.toml"


def test_both_unit_systems_give_one_case(tmp_path):
    si = load_case(write(tmp_path, CASE)).case
    mm = load_case(write(tmp_path, MILLIMETRES, "mm.toml")).case
    assert mm.units == "SI"  # everything inside is
    for name in ("strip", "material", "crease", "contact"):
        expected, found = (getattr(case, name).model_dump(exclude_none=True) for case in (si, mm))
        assert found.pop("law", "") == expected.pop("law", "")
        assert found == pytest.approx(expected, rel=1e-12), name
    assert mm.drive[0].model_dump()["travel"] == pytest.approx(0.15)


@pytest.mark.parametrize("text", [CASE, MILLIMETRES, SCENE])
def test_the_text_gives_the_same_case_again(tmp_path, text):
    loaded = load_case(write(tmp_path, text))
    again = load_case(write(tmp_path, loaded.text, "again.toml"))
    assert again.case == loaded.case
    assert again.text == loaded.text


def test_text_of_awkward_strings(tmp_path):
    case = load_case(write(tmp_path, CASE)).case
    title = 'quote " backslash \\ newline \n tab \t del \x7f bell \x07 \U0001f98b'
    from fsm.case.loading.toml_text import case_text

    odd = case.model_copy(update={"title": title, "expect": {'odd "key".x': case.expect["peak_force"]}})
    read = tomllib.loads(case_text(odd))  # a case would not have these keys; the text contains whatever it is given
    assert read["title"] == title and list(read["expect"]) == ['odd "key".x']


def test_a_scene_written_out(tmp_path):
    case = load_case(write(tmp_path, SCENE)).case
    assert case.scene is not None
    assert case.scene.gravity == (0.0, 0.0, pytest.approx(-9.81))
    a, b = case.scene.bodies
    assert a.mass == pytest.approx(2e-3)
    assert a.inertia[0] == pytest.approx(1e-9, abs=0.0)
    assert a.plate is not None
    assert a.plate.length == pytest.approx(0.01)
    assert b.mass == pytest.approx(1e-3)  # plain masses are tonnes
    assert b.inertia[0] == pytest.approx(1e-3)
    crease = case.scene.elements[0].crease
    assert isinstance(crease, SplineCrease)
    assert crease.angle == pytest.approx((0.0, math.pi / 2))
    assert crease.moment == pytest.approx((0.0, 9e-3))
    assert case.load[0].force == (1e-3, 0.0, 0.0)


def test_overrides(tmp_path):
    path = write(tmp_path, CASE)
    case = load_case(
        path,
        [
            "strip.fold_angle=75 deg",
            "strip.half_cell=false",
            "strip.held=[1, 5, 6]",
            "drive.0.speed=1 mm/s",
            'crease={law = "linear", stiffness = "2 N mm"}',
            "friction.law=tanh",  # a section that the base file does not have
            "friction.mu_dynamic=0.2",
            'friction.v_static="1 mm/s"',
            "drive.1.crease=2",  # one more drive
            "drive.1.speed=1e-3",
            "drive.1.travel=0.1",
            "solve.method=BDF",
            "gravity=[0, 0, -9.81]",
            "expect.peak_travel.value=0.027",
            "expect.peak_travel.atol=1e-3",
        ],
    ).case
    assert case.strip is not None
    assert case.friction is not None
    assert case.strip.fold_angle == pytest.approx(math.radians(75))
    assert case.strip.half_cell is False
    assert case.strip.held == (1, 5, 6)
    assert [drive.speed for drive in case.drive] == [1e-3, 1e-3]
    assert case.crease == LinearCrease(stiffness=2e-3)
    assert case.friction.law == "tanh"
    assert case.friction.v_static == 1e-3
    assert case.solve.method == "BDF"
    assert set(case.expect) == {"peak_force", "peak_travel"}


def test_none_takes_a_section_out(tmp_path):
    path = write(tmp_path, CASE)
    assert load_case(path, ["contact=none"]).case.contact is None
    assert load_case(path, ["drive.0=none", "solve.end_time=1"]).case.drive == ()
    assert load_case(path, ["title=none"]).case.title == ""


@pytest.mark.parametrize(
    ("override", "path", "words"),
    [
        ("strip.lenght=1", "--set strip.lenght", "did you mean `strip.length`?"),
        ("stripp.length=1", "--set stripp.length", "did you mean `strip`?"),
        ("strip.length.x=1", "--set strip.length.x", "`strip.length` is a value"),
        ("drive.speed=1", "--set drive.speed", "give the number of the item, from 0"),
        ("drive.2.speed=1", "--set drive.2.speed", "the case has only 1 items"),
        ("gravity.3=1", "--set gravity.3", "`gravity` has no item 3"),
        ("strip.panels", "--set strip.panels", "write the override as path=value"),
        ("strip.panels=", "--set strip.panels=", "write the override as path=value"),
        ("strip.panels=six", "strip.panels", 'must be a whole number; it is "six"'),
        ("crease.law=spline", "crease.stiffness", 'not used with law = "spline"; remove this key'),
        ("units=inch", "units", 'must be "SI" or "mm-N-s"; it is "inch"'),
    ],
)
def test_overrides_that_lead_nowhere(tmp_path, override, path, words):
    assert words in faults(write(tmp_path, CASE), override)[path]


def spline(**keys: str) -> str:
    lines = "".join(f"{key} = {value}\n" for key, value in keys.items())
    return CASE.replace('law = "linear"\nstiffness = 9.0e-3\n', f'law = "spline"\n{lines}')


@pytest.mark.parametrize(
    ("data", "keys"),
    [
        ("angle (deg), moment (N mm)\n0, 0\n30, 1\n60, 3\n90, 4\n", {}),
        ("# a test\n\nAngle [deg];Moment [mN m]\n0;0\n30;1\n60;3\n90;4\n", {}),
        ("angle (deg)\tmoment (mJ)\n0\t0\n30\t1,0\n60\t3\n90\t4\n", {}),
        ("angle (deg) moment (N mm)\n0   0\n30  1.0e0\n 60 3\n90 4", {}),
        ("moment (N mm), angle (deg)\n4, 90\n3, 60\n1, 30\n0, 0\n", {}),
        ("angle (deg), force (N), lever arm (mm)\n0, 0, 20\n30, 0.05, 20\n60, 0.1, 30\n90, 0.2, 20\n", {}),
        (
            "\ufeffangle,moment\r\n0,0\r\n30,1\r\n60,3\r\n90,4\r\n",
            {"angle_unit": '"deg"', "moment_unit": '"N mm"'},
        ),
        ("90 4\n60 3\n30 1\n0 0\n", {"angle_unit": '"deg"', "moment_unit": '"mN m"'}),
    ],
)
def test_crease_files(tmp_path, data, keys):
    write(tmp_path, data, "crease.csv")
    loaded = load_case(write(tmp_path, spline(data='"crease.csv"', **keys)))
    crease = loaded.case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.data is None  # the case carries its curve
    assert crease.angle == pytest.approx([math.radians(a) for a in (0, 30, 60, 90)])
    assert crease.moment == pytest.approx([0, 1e-3, 3e-3, 4e-3])
    (tmp_path / "crease.csv").unlink()
    assert load_case(write(tmp_path, loaded.text, "again.toml")).case == loaded.case


def test_crease_file_without_units_is_in_plain_numbers(tmp_path):
    write(tmp_path, "angle,moment\n0,0\n0.5,1\n1,3\n1.5,4\n", "crease.csv")
    text = MILLIMETRES.replace('stiffness = 9\nlaw = "linear"', 'law = "spline"\ndata = "crease.csv"')
    crease = load_case(write(tmp_path, text)).case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.angle == (0.0, 0.5, 1.0, 1.5)
    assert crease.moment == pytest.approx([0, 1e-3, 3e-3, 4e-3])


def test_falling_lists_are_turned_round(tmp_path):
    crease = load_case(write(tmp_path, spline(angle="[3, 2, 1, 0]", moment="[4, 3, 1, 0]"))).case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.angle == (0.0, 1.0, 2.0, 3.0)
    assert crease.moment == (0.0, 1.0, 3.0, 4.0)


def test_measured_hinge_without_a_header_from_the_top_down(tmp_path):
    rows = [f"{150 - 10 * k:.18e} {torque:.18e}" for k, torque in enumerate(reversed(TORQUE))]
    (tmp_path / "hinge_torque.txt").write_text("\n".join(rows))
    text = spline(data='"hinge_torque.txt"', angle_unit='"deg"', moment_unit='"mN m"')
    crease = load_case(write(tmp_path, text)).case.crease
    assert isinstance(crease, SplineCrease)
    assert crease.angle is not None
    assert crease.moment is not None
    assert crease.angle == pytest.approx([math.radians(a) for a in range(-130, 151, 10)])
    assert crease.moment == pytest.approx([1e-3 * torque for torque in TORQUE])


def test_the_schema_knows_every_path_of_the_models():
    assert set(root({}).keys()) == set(Case.model_fields)
    place, path = locate({"crease": {"law": "spline"}}, ("crease", "spline", "angle", 2), Case)
    assert path == ["crease", "angle", 2]
    assert place is not None
    assert place.unit() == "rad"
    place, path = locate({"load": [{"time": {"kind": "ramp"}}]}, ("load", 0, "time", "ramp", "end"), Case)
    assert path == ["load", 0, "time", "end"]
    assert place is not None
    assert place.unit() == "s"


def test_reading_a_case_imports_nothing_heavy(tmp_path):
    write(tmp_path, CASE)
    code = (
        "import sys, fsm.cli.command_line, fsm.case.loading.load_case as m; m.load_case(sys.argv[1]);"
        "print([n for n in ('numpy', 'numba', 'scipy', 'matplotlib', 'h5py') if n in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "case.toml")],
        capture_output=True, text=True, check=True, env={"PYTHONPATH": ":".join(sys.path)},
    )  # fmt: skip
    assert done.stdout.strip() == "[]"


def test_help_imports_only_click(tmp_path):
    code = (
        "import sys, click.testing, fsm.cli.command_line; "
        "r = click.testing.CliRunner().invoke(fsm.cli.command_line.cli, ['--help']);"
        "print(r.exit_code, [n for n in ('pydantic', 'numpy', 'numba') if n in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True,
        env={"PYTHONPATH": ":".join(sys.path)},
    )  # fmt: skip
    assert done.stdout.strip() == "0 []"


def test_public_names_exist_where_they_are_said_to_be():
    import importlib.util

    import fsm

    # fsm.calibrate is both a package and a function
    assert set(fsm._HOME) | {"__version__", "calibrate"} == set(fsm.__all__)
    assert re.match(r"\d", fsm.__version__)
    for name, module in fsm._HOME.items():
        if importlib.util.find_spec(module) is not None:
            assert getattr(fsm, name).__name__ == fsm._RENAMED.get(name, name)
    with pytest.raises(AttributeError, match="no attribute 'load_cas'"):
        _ = fsm.load_cas
