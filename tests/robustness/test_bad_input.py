"""Wrong input through the command line: exit code 2, a line for each mistake, no traceback, no file."""

import re
import string
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fsm.case.loading.load_case import load_case
from fsm.cli.command_line import cli
from fsm.errors import CaseError
from tests.case_texts import strip

CASE = f"""
{strip()}[[drive]]
crease = 3
speed = "2 mm/s"
travel = "150 mm"
"""

SPLINE = CASE.replace('law = "linear"\nstiffness = 9.0e-3', 'law = "spline"\ndata = "crease.csv"')


def run(folder: Path, text: str = CASE, *options: str, command: str = "run") -> Result:
    """Run a case file with a mistake; the program must not write anything."""
    case = folder / "case.toml"
    case.write_text(text, encoding="utf-8")
    out = [] if command == "check" else ["--out", str(folder / "out")]
    before = sorted(folder.iterdir())
    result = CliRunner().invoke(cli, [command, str(case), *out, *options])
    assert sorted(folder.iterdir()) == before, "something was written"
    return result


def faults(result: Result, source: Path) -> list[str]:
    """The lines of a refusal, without the file name at the start of each line."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    lines = result.stderr.splitlines()
    assert all(line.startswith(f"{source}: ") for line in lines), result.stderr
    return [line.removeprefix(f"{source}: ") for line in lines]


ONE_MISTAKE = {
    "unknown key": (
        ("thickness = 3e-4", "thickness = 3e-4\nlenght = 1"),
        "strip.lenght: unknown key; did you mean `length`?",
    ),
    "misspelt key": (("length = 0.48", "lenght = 0.48"), "strip.lenght: unknown key; did you mean `length`?"),
    "unknown section": (
        ("[material]", "[frition]\n[material]"),
        "frition: unknown key; did you mean `friction`?",
    ),
    "missing key": (("width = 0.04\n", ""), "strip.width: missing; give a value in m"),
    "missing section": (
        ("[material]\nyoung = 3e9\ndensity = 800\n", ""),
        "material: section [material] is missing; a strip needs this section",
    ),
    "negative thickness": (
        ("thickness = 3e-4", "thickness = -0.0003"),
        "strip.thickness: must be greater than 0; it is -0.0003 m",
    ),
    "wrong unit": (
        ("width = 0.04", 'width = "40 kg"'),
        'strip.width: "40 kg" has the wrong unit; give a value in m',
    ),
    "unknown unit": (
        ("young = 3e9", 'young = "3 gpa"'),
        "material.young: \"3 gpa\": unknown unit 'gpa'; did you mean `GPa`?; give a value in Pa",
    ),
    "not a number": (
        ("width = 0.04", "width = nan"),
        "strip.width: nan is not a finite number; give a value in m",
    ),
    "infinite": (
        ("young = 3e9", "young = inf"),
        "material.young: inf is not a finite number; give a value in Pa",
    ),
    "text": (
        ("young = 3e9", 'young = "stiff"'),
        'material.young: "stiff" is not a number; give a value in Pa',
    ),
    "degrees as a number": (
        ('fold_angle = "80 deg"', "fold_angle = 80"),
        'strip.fold_angle: must be less than 1.5708 rad; it is 80 rad; write degrees as text, "80 deg"',
    ),
    "fold angle too large": (
        ('fold_angle = "80 deg"', 'fold_angle = "95 deg"'),
        'strip.fold_angle: must be less than 90 deg; it is "95 deg"',
    ),
    "percentage for an angle": (
        ('fold_angle = "80 deg"', 'fold_angle = "50 %"'),
        'strip.fold_angle: "50 %" is a percentage; give a value in rad',
    ),
    "rest angle beyond closed": (
        ("stiffness = 9.0e-3", 'stiffness = 9.0e-3\nrest_angle = "400 deg"'),
        'crease.rest_angle: must be at most 180 deg; it is "400 deg"',
    ),
    "rest angle in degrees as a number": (
        ("stiffness = 9.0e-3", "stiffness = 9.0e-3\nrest_angle = 160"),
        'crease.rest_angle: must be at most 3.14159 rad; it is 160 rad; write degrees as text, "160 deg"',
    ),
    "line break in the title": (
        ("[strip]", 'title = "a\\nb"\n[strip]'),
        'title: must be text without line breaks and control characters; it is "a b"',
    ),
    "zero segments": (
        ("panels = 6", "panels = 6\nsegments_per_panel = 0"),
        "strip.segments_per_panel: must be at least 1; it is 0",
    ),
    "half a segment": (
        ("panels = 6", "panels = 6\nsegments_per_panel = 2.5"),
        "strip.segments_per_panel: must be a whole number; it is 2.5",
    ),
    "true for a count": (("panels = 6", "panels = true"), "strip.panels: must be a whole number; it is true"),
    "crease out of range": (
        ("crease = 3", "crease = 6"),
        "drive.0.crease: must be a crease number from 1 to 5, with 6 panels; it is 6",
    ),
    "crease zero": (
        ("crease = 3", "crease = 0"),
        "drive.0.crease: must be a crease number from 1 to 5, with 6 panels; it is 0",
    ),
    "held panel out of range": (
        ("panels = 6", "panels = 6\nheld = [1, 7]"),
        "strip.held.1: must be a panel number from 1 to 6; it is 7",
    ),
    "all panels held": (
        ("panels = 6", "panels = 6\nheld = [1, 2, 3, 4, 5, 6]"),
        "strip.held: all 6 panels are held, so none can move; hold fewer panels",
    ),
    "two panels, both held": (
        ("panels = 6", "panels = 2"),
        "strip.held: all 2 panels are held (by default the first and the last), so none can move",
    ),
    "drive against a support": (
        ("panels = 6", "panels = 6\nheld = [3, 4]"),
        "drive.0.crease: crease 3 is an edge of panels 3 and 4, which are held (by `strip.held`), so it "
        "cannot move; choose another",
    ),
    "drive at the end of a held panel": (
        ("crease = 3", "crease = 1"),
        "drive.0.crease: crease 1 is an edge of panel 1, which is held (by default), so it "
        "cannot move; choose another",
    ),
    "two drives on one crease": (
        ("[[drive]]", "[[drive]]\ncrease = 3\nspeed = 1\ntravel = 0.1\n[[drive]]"),
        "drive.1: crease 3 is already driven by drive.0; remove one of them",
    ),
    "contact pair out of range": (
        ("[[drive]]", "[contact]\nstiffness = 1e9\npairs = [[1, 2], [1, 9]]\n[[drive]]"),
        "contact.pairs.1: must be two different panel numbers from 1 to 6; it is [1, 9]",
    ),
    "contact of a panel with itself": (
        ("[[drive]]", "[contact]\nstiffness = 1e9\npairs = [[3, 3]]\n[[drive]]"),
        "contact.pairs.0: must be two different panel numbers from 1 to 6; it is [3, 3]",
    ),
    "increment of a method that integrates": (
        ("[[drive]]", '[solve]\nmethod = "Radau-blocks"\nincrement = "1 mm"\n[[drive]]'),
        'solve.increment: is used by method = "static" and "auto" only, not by "Radau-blocks"; remove this key',
    ),
    "imperfection of a method that integrates": (
        ("[[drive]]", '[solve]\nmethod = "generalized-alpha"\nimperfection = -1\n[[drive]]'),
        'solve.imperfection: is used by method = "static" and "auto" only, not by "generalized-alpha"; remove this key',
    ),
    "drive of nothing": (
        ("crease = 3\n", ""),
        'drive.0: give one of `crease` or `panel` (its number) or `end` ("first" or "last") of a strip, `body` (its name), '
        "`bodies`, `edge` (of a lattice or sheet), or `at`",
    ),
    "drive not a list": (
        ("[[drive]]", "[drive]"),
        "drive: must be a list of sections; write its name in two brackets",
    ),
    "no end": (
        ('[[drive]]\ncrease = 3\nspeed = "2 mm/s"\ntravel = "150 mm"\n', ""),
        "solve.end_time: missing, and there is no [[drive]], so the run has no end; "
        "give one of them",
    ),
    "friction without contact": (
        ("[[drive]]", '[friction]\nlaw = "tanh"\nmu_dynamic = 0.2\nv_static = 0.001\n[[drive]]'),
        "friction: [friction] requires [contact], which is missing; "
        "add [contact], or remove [friction]",
    ),
    "unknown law": (
        ('law = "linear"', 'law = "liner"'),
        'crease.law: must be "linear" or "spline" or "family"; it is "liner"; did you mean `linear`?',
    ),
    "no law": (('law = "linear"\n', ""), 'crease.law: missing; it must be "linear" or "spline"'),
    "key of another law": (
        ("stiffness = 9.0e-3", 'stiffness = 9.0e-3\ndata = "a.csv"'),
        'crease.data: not used with law = "linear"; remove this key',
    ),
    "section that is a number": (
        ("[[drive]]", "[[load]]\nbody = 3\n[[drive]]"),
        "load.0.body: must be text in quotes; it is 3",
    ),
    "too few components": (
        ("crease = 3", "crease = 3\ndirection = [0, 1]"),
        "drive.0.direction: has only 2 values; value number 3 is missing",
    ),
    "too many components": (
        ("crease = 3", "crease = 3\ndirection = [0, 1, 0, 0]"),
        "drive.0.direction: must have 3 values, not 4; it is [0, 1, 0, 0]",
    ),
    "contact of another exponent": (
        ("[[drive]]", '[contact]\nexponent = 2\nstiffness = "1e9 N/m^1.5"\n[[drive]]'),
        'contact.stiffness: "1e9 N/m^1.5" has the wrong unit; give a value in N/m^2',
    ),
    "scene beside a strip": (
        ("[[drive]]", "[[scene.frames]]\nname = 'tip'\non = 'sail'\nat = [0]\n[[drive]]"),
        "scene.frames.0.on: no film, cable, beam or truss is called 'sail'; there are none",
    ),
    "unquoted unit": (
        ("width = 0.04", "width = 40 mm"),
        "line 4: expected newline or end of document after a statement in `width = 40 mm`; "
        "put text and numbers with a unit in quotes",
    ),
    "broken TOML": (("[material]", "[material"), "line 9: expected ']' at the end of a table declaration"),
}


@pytest.mark.parametrize("mistake", ONE_MISTAKE)
def test_one_mistake_is_one_line(tmp_path, mistake):
    (old, new), expected = ONE_MISTAKE[mistake]
    assert CASE.count(old) == 1
    lines = faults(run(tmp_path, CASE.replace(old, new)), tmp_path / "case.toml")
    assert len(lines) == 1, lines
    assert lines[0].startswith(expected)


@pytest.mark.parametrize("command", ["run", "check", "preview"])
def test_all_mistakes_at_once(tmp_path, command):
    """A broken section does not hide mistakes of other sections or contradictions between correct sections."""
    text = CASE.replace("young = 3e9", "young = -3\ncolour = 1").replace("crease = 3", "crease = 9")
    text = text.replace("stiffness = 9.0e-3", 'stiffness = "9 N"').replace("[crease]", "[solv]\n[crease]")
    lines = faults(run(tmp_path, text, command=command), tmp_path / "case.toml")
    assert [line.split(":")[0] for line in lines] == [
        "solv",
        "material.young",
        "material.colour",
        "crease.stiffness",
        "drive.0.crease",
    ]


def test_mistakes_in_millimetres_are_told_in_millimetres(tmp_path):
    text = CASE.replace("[strip]", 'units = "mm-N-s"\n[strip]').replace(
        "thickness = 3e-4", "thickness = -0.3"
    )
    lines = faults(run(tmp_path, text.replace("travel = ", "travl = ")), tmp_path / "case.toml")
    assert lines == [
        "strip.thickness: must be greater than 0; it is -0.3 mm",
        "drive.0.travl: unknown key; did you mean `travel`?",
    ]


@pytest.mark.parametrize("command", ["run", "check", "preview", "table", "plot"])
def test_missing_file(tmp_path, command):
    missing = tmp_path / "nowhere" / "case.toml"
    out = [] if command == "check" else ["--out", str(tmp_path / "out")]
    result = CliRunner().invoke(cli, [command, str(missing), *out])
    assert result.exit_code == 2, result.output
    assert len(result.stderr.splitlines()) == 1
    assert str(missing) in result.stderr
    assert re.search("no such file", result.stderr, re.IGNORECASE)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xff\xfe\x00[", "is not UTF-8 text"),
        (b"\x00\x01\x02", "line 1: "),
        (b"", "section [strip] is missing"),
    ],
)
def test_not_a_case_at_all(tmp_path, content, words):
    case = tmp_path / "case.toml"
    case.write_bytes(content)
    result = CliRunner().invoke(cli, ["run", str(case), "--out", str(tmp_path / "out")])
    assert words in faults(result, case)[0]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--set", "strip.lenght=1"], "--set strip.lenght: unknown key; did you mean `strip.length`?"),
        (["--set", "strip.length"], "--set strip.length: write the override as path=value"),
        (
            ["--method", "RK45"],
            'solve.method: must be "auto", "static", "arc-length", "generalized-alpha", "mean-force", "newmark", '
            '"explicit", "Radau-blocks", "Radau", "BDF" or "LSODA"; it is "RK45"',
        ),
        (["--method", "arc_length"], 'solve.method: must be "auto", "static", "arc-length"'),
    ],
)
def test_bad_options(tmp_path, options, words):
    assert faults(run(tmp_path, CASE, *options), tmp_path / "case.toml")[0].startswith(words)


def test_bad_usage(tmp_path):
    (tmp_path / "file").write_text("mine")
    result = run(tmp_path, CASE, "--out", str(tmp_path / "file"))
    assert result.exit_code == 2
    assert "is a file; give the name of a folder" in result.stderr
    assert (tmp_path / "file").read_text() == "mine"
    assert CliRunner().invoke(cli, ["run"]).exit_code == 2
    assert CliRunner().invoke(cli, ["rnu"]).exit_code == 2


@pytest.mark.parametrize("out", ["", " "])
@pytest.mark.parametrize("command", ["run", "table", "calibrate", "plot"])
def test_an_empty_folder_is_refused(tmp_path, monkeypatch, command, out):
    """An empty name would mean the present folder, which the command does not name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    (tmp_path / "table.csv").write_text("case, strip.thickness\none, 3e-4\n", encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    what = {"run": ["case.toml"], "table": ["table.csv"], "calibrate": ["crease", "table.csv"], "plot": ["result.h5"]}
    result = CliRunner().invoke(cli, [command, *what[command], "--out", out])
    assert result.exit_code == 2
    assert "is not the name of a folder; give a name, or . for the current folder" in result.stderr
    assert sorted(tmp_path.iterdir()) == before, "something was written"


def test_what_only_statics_has_is_taken_where_statics_may_come(tmp_path):
    case = tmp_path / "case.toml"
    for method in ("auto", "static"):
        keys = [f"solve.method={method}", "solve.increment=1 mm", "solve.imperfection=0.5"]
        case.write_text(CASE, encoding="utf-8")
        assert load_case(case, keys).case.solve.increment == 1e-3
    resolved = ["solve.method=Radau", "solve.imperfection=0"]  # which say every default
    assert load_case(case, resolved).case.solve.method == "Radau"


def test_internal_errors_and_interrupts_are_told_apart(tmp_path, monkeypatch):
    case = tmp_path / "case.toml"
    case.write_text(CASE)

    def fail(error: BaseException):
        def load(*arguments):
            raise error

        monkeypatch.setattr("fsm.case.loading.load_case.load_case", load)
        return CliRunner()

    result = fail(ZeroDivisionError("a\nb")).invoke(cli, ["check", str(case)])
    assert result.exit_code == 1
    assert result.stderr.startswith("internal error: ZeroDivisionError: a b; repeat the command with --debug")
    assert "Traceback" not in result.stderr
    for arguments in (["check", str(case), "--debug"], ["--debug", "check", str(case)]):
        result = CliRunner().invoke(cli, arguments)
        assert result.exit_code == 1
        assert "Traceback" in result.stderr
    result = fail(KeyboardInterrupt()).invoke(cli, ["check", str(case)])
    assert (result.exit_code, result.stderr) == (130, "interrupted\n")
    result = fail(PermissionError(13, "Permission denied", "/out")).invoke(cli, ["check", str(case)])
    assert (result.exit_code, result.stderr) == (2, "/out: Permission denied\n")


LINES = CASE.splitlines()
VALUES = st.sampled_from(
    [
        "-1",
        "0",
        "1e400",
        "nan",
        "true",
        '""',
        '"1 m"',
        "[]",
        "[1, 2]",
        "{}",
        "{ a = 1 }",
        "1979-05-27",
        '"80 deg"',
        "1e9",
    ]
)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_random_damage_is_refused_in_words_or_read(tmp_path, data):
    """A case with changed lines is either accepted or refused by a message; it raises no other exception."""
    lines = list(LINES)
    for _ in range(data.draw(st.integers(1, 4))):
        index = data.draw(st.integers(1, len(lines) - 1))
        match data.draw(st.sampled_from(["drop", "double", "value", "key", "text"])):
            case "drop":
                lines[index] = ""
            case "double":
                lines.insert(index, lines[index])
            case "value":
                lines[index] = f"{lines[index].split('=')[0]} = {data.draw(VALUES)}"
            case "key":
                key = data.draw(st.text(string.ascii_lowercase + "._", min_size=1, max_size=8))
                lines[index] = f"{key} = {data.draw(VALUES)}"
            case "text":
                lines[index] = data.draw(st.text(max_size=20))
    path = tmp_path / "case.toml"
    path.write_text("\n".join(lines), encoding="utf-8", errors="replace")
    try:
        text, faults = load_case(path).text, ()
    except CaseError as error:
        text, faults = "", error.faults
    assert bool(text) != bool(faults)
    assert not text or tomllib.loads(text)["units"] == "SI"
    for fault in faults:
        assert fault.message
        assert not re.search(r"\n|pydantic|Input should|is not accepted", fault.message)
