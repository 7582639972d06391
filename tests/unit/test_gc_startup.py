"""Garbage collection leaves out imported objects and the end of the process, and treats other objects as usual."""

import subprocess
import sys


def _printed(code: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_imports_are_put_aside_once(tmp_path):
    for name in ("one", "other"):  # modules that nothing else, such as a measurement of the tests, has imported before
        (tmp_path / f"{name}_of_ours.py").write_text("kept = [[k] for k in range(1000)]\n", encoding="utf-8")
    code = (
        "import gc, sys\n"
        "from fsm.gc_startup import imports_outside_gc\n"
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


def test_the_end():
    code = "import gc\nfrom fsm.gc_startup import skip_final_gc as it\nwith it(): print(gc.get_freeze_count())\n"
    before, after = _printed(code + "print(gc.get_freeze_count())")
    assert (before, int(after) > 0) == ("0", True)


def test_a_library_leaves_the_process_of_another_alone():
    assert _printed("import gc, fsm.run, fsm.cli, fsm.table\nprint(gc.isenabled(), gc.get_freeze_count())") == ["True 0"]
