"""Figures that a copy of the process draws: each is drawn once, and a copy that fails loses none."""

import os
import time
from functools import partial
from pathlib import Path

import pytest

from fsm.views.plots import beside, figures
from fsm.views.plots.drawing import drawing

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a process cannot be copied")


def _draw(path: Path) -> None:
    time.sleep(0.02)
    with path.open("a", encoding="utf-8") as file:
        file.write(f"{os.getpid()}\n")


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr(beside, "processors", lambda: 2)
    monkeypatch.setattr(beside.sys, "platform", "linux")


def _by(folder):
    return [path.read_text(encoding="utf-8").split() for path in sorted(folder.iterdir())]


def test_both_draw_and_each_figure_once(tmp_path):
    beside.draw_all([partial(_draw, tmp_path / f"{k}") for k in range(6)], two=True)
    drawn = _by(tmp_path)
    assert len(drawn) == 6 and all(len(one) == 1 for one in drawn)
    assert {one[0] for one in drawn} > {str(os.getpid())}  # the copy has drawn some


def test_figures_in_which_the_copy_fails_are_drawn_here(tmp_path):
    own = os.getpid()

    def plot(path: Path) -> None:
        if os.getpid() != own:
            raise ValueError(path.name)
        _draw(path)

    beside.draw_all([partial(plot, tmp_path / f"{k}") for k in range(4)], two=True)
    assert _by(tmp_path) == [[str(own)]] * 4


def test_error_of_a_figure_is_raised(tmp_path):
    def plot(number: int) -> None:
        time.sleep(0.02)
        if number == 3:
            raise ValueError(f"figure {number}")

    with pytest.raises(ValueError, match="figure 3"):
        beside.draw_all([partial(plot, k) for k in range(5)], two=True)


def _write_number(path: Path) -> None:
    path.write_text(str(os.getpid()), encoding="utf-8")


def test_the_copy_that_waits_answers_each_request_and_ends_with_the_block(tmp_path):
    with beside.waiting_copy(lambda: _write_number):
        assert beside.ask_copy(tmp_path / "first")()
        assert beside.ask_copy(tmp_path / "second")()
    numbers = {path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    assert len(numbers) == 1 and numbers != {str(os.getpid())}
    with pytest.raises(ProcessLookupError):
        os.kill(int(numbers.pop()), 0)
    assert not beside.ask_copy(tmp_path / "third")()  # there is none


def test_a_copy_that_fails_or_ends_leaves_the_request_to_this_process():
    def answer(how: str) -> None:
        if how == "end":
            os._exit(1)
        raise ValueError(how)

    with beside.waiting_copy(lambda: answer):
        assert [beside.ask_copy(how)() for how in ("fail", "fail", "end", "fail")] == [False] * 4


def test_a_result_is_drawn_by_the_copy_of_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "_draw_all", lambda solution, folder: _write_number(folder / solution))
    monkeypatch.setattr(figures, "_import_plots", lambda: None)
    monkeypatch.setattr(figures, "figures_of", lambda solution: {})
    with drawing(two=True), figures.drawn_beside():
        figures.draw("by the copy", tmp_path)
    figures.draw("here", tmp_path)
    assert (tmp_path / "here").read_text(encoding="utf-8") == str(os.getpid())
    assert (tmp_path / "by the copy").read_text(encoding="utf-8") != str(os.getpid())


def test_copies_of_the_copy_end_with_it(tmp_path):
    """As when a run is interrupted while two processes draw its figures."""

    def answer(path: Path) -> None:
        if not os.fork():
            time.sleep(60.0)
        path.write_text(str(os.getpgid(0)), encoding="utf-8")

    with beside.waiting_copy(lambda: answer):
        assert beside.ask_copy(tmp_path / "group")()
    group, deadline = int((tmp_path / "group").read_text(encoding="utf-8")), time.monotonic() + 10.0
    assert group != os.getpgid(0)
    while _has_members(group) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not _has_members(group)


def _has_members(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    stat = Path("/proc").glob("[0-9]*/stat")
    running = [fields for path in stat if (fields := _fields(path)) and fields[2] == str(group) and fields[0] != "Z"]
    return bool(running)


def _fields(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:
        return []
