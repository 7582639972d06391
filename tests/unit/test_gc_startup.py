"""Garbage collection leaves out imported objects and the end of the process. Runs import only parts that they need."""

import subprocess
import sys
from pathlib import Path

import pytest

STRIP = Path(__file__).parents[2] / "folding_cases" / "strip_pull" / "case.toml"


def _printed(code: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_imports_are_put_aside_once(tmp_path):
    for name in ("one", "other"):  # modules that other parts, such as a measurement of the tests, have not imported before
        (tmp_path / f"{name}_of_ours.py").write_text("kept = [[k] for k in range(1000)]\n", encoding="utf-8")
    code = (
        "import gc, sys\n"
        "from fsm.io.gc_startup import imports_outside_gc\n"
        f"sys.path.insert(0, {str(tmp_path)!r})\n"
        "for module in ('one_of_ours', 'one_of_ours', 'other_of_ours'):\n"
        "    with imports_outside_gc():\n"
        "        __import__(module); print(gc.isenabled())\n"
        "    print(gc.isenabled(), gc.get_freeze_count())\n"
    )
    lines = _printed(code)
    assert lines[::2] == ["False"] * 3
    assert all(line.startswith("True") for line in lines[1::2])
    first, again, other = (int(line.split()[1]) for line in lines[1::2])
    assert 0 < again <= first < other


def test_collections_are_rare_within_a_command_and_left_out_at_its_end():
    state = "print(gc.get_freeze_count(), gc.get_threshold()[0])"
    before, within, after = (
        [int(number) for number in line.split()]
        for line in _printed(f"import gc\nfrom fsm.io.gc_startup import rare_gc\n{state}\nwith rare_gc(): {state}\n{state}")
    )
    assert within[0] == 0 and within[1] > 10 * before[1]
    assert after[0] > 0 and after[1] == before[1]


def test_a_library_leaves_the_process_of_another_alone():
    code = "import gc, fsm.run.run_case, fsm.cli.command_line, fsm.run.table\nprint(gc.isenabled(), gc.get_freeze_count())"
    assert _printed(code) == ["True 0"]


@pytest.mark.nightly
def test_a_pulled_strip_imports_no_part_of_scipy(tmp_path):
    """Its import takes longer than the solution of a small model."""
    code = "import sys\nfrom pathlib import Path\nfrom fsm.run.run_case import run_case\n"
    code += "from fsm.case.loading.load_case import load_case\n"
    code += f"run_case(load_case({str(STRIP)!r}), Path({str(tmp_path)!r}), progress=False)\n"
    parts = "'sparse', 'linalg', 'interpolate', 'optimize', 'integrate'"
    code += f"print([part for part in ({parts}) if f'scipy.{{part}}' in sys.modules])"
    _printed(code)  # numba imports a part of SciPy to compile kernels
    assert _printed(code) == ["[]"]


def test_a_quick_import_leaves_matplotlib_as_it_is():
    """Tables of properties are restored after the block, and artists accept their properties."""
    code = "from fsm.io.gc_startup import plain_matplotlib\nwith plain_matplotlib():\n"
    code += "    from matplotlib.lines import Line2D\n"
    code += "from matplotlib.artist import Artist, kwdoc\nline = Line2D([], [])\nline.set(linewidth=3.0)\n"
    code += "class Later(Artist):\n    pass\n"
    code += "print(line.get_linewidth(), 'linewidth' in kwdoc(Line2D), 'alpha' in str(Later.set.__signature__))"
    assert _printed(code) == ["3.0 True True"]


def test_a_quick_import_of_numba_leaves_other_packages_as_they_are():
    code = "from fsm.io.gc_startup import import_numba\nimport_numba()\nimport sys\n"
    code += "print('numba' in sys.modules, 'scipy' in sys.modules, 'yaml' in sys.modules)\n"
    code += "import scipy.linalg, yaml\nprint(yaml.safe_load('a: 1'), float(scipy.linalg.det([[2.0]])))"
    assert _printed(code) == ["True False False", "{'a': 1} 2.0"]
