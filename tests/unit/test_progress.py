"""Progress messages of a run without a terminal, and of a run with a progress function."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import fsm.run.progress
from fsm.run.progress import Progress, report_compilation


class Compiler:
    """Replaces `fsm.kernels.jit`."""

    def __init__(self) -> None:
        self.told: list[Callable[[str], None]] = []

    def on_compile(self, callback: Callable[[str], None]) -> Callable[[], None]:
        self.told.append(callback)
        return lambda: self.told.remove(callback)

    def kernel_names(self) -> tuple[str, ...]:
        return tuple("abc")


def test_lines_now_and_then_and_while_compiling(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    clock, jit = [0.0], Compiler()
    monkeypatch.setattr(fsm.run.progress.time, "monotonic", lambda: clock[0])
    with Progress(True, 4.0, "strip", jit) as bar:
        for _ in range(11):
            jit.told[0]("a")
        for now in (1.0, 11.0, 12.0, 25.0):
            clock[0] = now
            bar.step(now / 10.0, int(now))
    assert jit.told == []
    assert capsys.readouterr().err.splitlines() == [
        "strip: compiling kernels (once only): 1 of at most 3",
        "strip: compiling kernels (once only): 11 of at most 3",
        "strip: 28 %, 11 steps",
        "strip: 62 %, 25 steps",
    ]


def test_a_function_gets_the_fraction_and_nothing_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    seen: list[float] = []
    with Progress(seen.append, 2.0, "strip", Compiler()) as bar:
        bar.step(0.5, 1)
        bar.step(2.0, 3)
    assert seen == [0.25, 1.0]
    assert capsys.readouterr() == ("", "")


def test_a_further_solve_has_its_own_progress(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock, seen = [0.0], list[float]()
    monkeypatch.setattr(fsm.run.progress.time, "monotonic", lambda: clock[0])
    for show in (True, seen.append):
        with Progress(show, 4.0, "array", Compiler()) as bar:
            bar.step(4.0, 1)
            bar.further("rigid bars", 2.0)
            clock[0] += 11.0
            bar.step(1.0, 7)
    assert seen == [1.0, 0.5]
    assert capsys.readouterr().err.splitlines() == ["array: rigid bars: 50 %, 7 steps"]


@pytest.mark.parametrize(("wanted", "said"), [(True, ["strip: compiling kernels (once only)"]), (False, []), (print, [])])
def test_what_is_compiled_before_there_is_progress(wanted, said, capsys: pytest.CaptureFixture[str]) -> None:
    jit = Compiler()
    with report_compilation(wanted, "strip", jit):
        for tell in [*jit.told, *jit.told]:
            tell("a")
    assert jit.told == []
    assert capsys.readouterr().err.splitlines() == said
