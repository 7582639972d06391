"""A process of our own looks for garbage seldom; a library of somebody else's process leaves it alone."""

import subprocess
import sys

RATE = "import gc; print(gc.get_threshold(), gc.get_freeze_count() > 0)"


def _printed(code: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_a_process_of_our_own():
    before, within, after = _printed(f"{RATE}\nfrom fsm.garbage import seldom\nwith seldom(): {RATE}\n{RATE}")
    assert not before.endswith("True") and not within.endswith("True")
    assert within != before
    assert after.endswith("True")


def test_workers_take_part_and_importing_changes_nothing():
    code = (
        "import gc\n"
        "from fsm.pool import run_jobs\n"
        "import fsm.run, fsm.cli\n"
        "if __name__ == '__main__':\n"
        "    (outcome,) = run_jobs(eval, [\"__import__('gc').get_threshold()[0]\"], 1)\n"
        "    print(outcome.value)\n"
        "    print(gc.get_threshold()[0], gc.get_freeze_count())\n"
    )
    worker, here = _printed(code)
    assert int(worker) > int(here.split()[0])
    assert here.endswith(" 0")
