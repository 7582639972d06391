"""Progress of a run: a bar by tqdm on a terminal, plain lines elsewhere, or no output."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fsm.text.shown_units import count

_LINE_EVERY = 10.0
"""Time between plain lines, s."""


class Progress:
    """Progress of one run, as a context manager.

    Parameters
    ----------
    show : bool or callable
        Whether to show progress; a callable receives the completed fraction instead.
    end : end time of the run, s
    title : name of the run
    jit : module `fsm.kernels.jit`, to show the compilation of kernels; None where there are no kernels
    """

    def __init__(
        self, show: bool | Callable[[float], None], end: float, title: str, jit: Any = None
    ) -> None:
        self._report = show if callable(show) else None
        self._lines = show is True and not sys.stderr.isatty()
        self._bar: Any = None
        if show is True and not self._lines:
            from tqdm import tqdm

            self._bar = tqdm(total=100.0, desc=title[:40], unit="%")
            self._bar.bar_format = "{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"
        self._end, self._title, self._name, self._jit = end, title, title, jit
        self._last_line = time.monotonic()
        self._compiled = 0
        self._unsubscribe: Callable[[], None] | None = None
        self._visible = show is True

    def __enter__(self) -> Progress:
        if self._visible and self._jit is not None:
            self._unsubscribe = self._jit.on_compile(self._compiling)
        return self

    def __exit__(self, *exception: object) -> None:
        if self._unsubscribe is not None:
            self._unsubscribe()
        if self._bar is not None:
            self._bar.close()

    def step(self, t: float, steps: int) -> None:
        """Update the time reached (s) and the number of steps."""
        fraction = t / self._end
        if self._report is not None:
            self._report(fraction)
        if self._bar is not None:
            self._bar.set_postfix_str(count(steps, "step"), refresh=False)
            self._bar.update(100.0 * fraction - self._bar.n)
        elif self._lines and time.monotonic() - self._last_line > _LINE_EVERY:
            self._last_line = time.monotonic()
            print(f"{self._name}: {100 * fraction:.0f} %, {count(steps, 'step')}", file=sys.stderr, flush=True)

    def further(self, name: str, end: float) -> None:
        """Show the progress of a further solve of the same run, from zero again.

        Parameters
        ----------
        name : name of the further solve, shown beside that of the run
        end : its end time, s
        """
        self._end, self._name = end, f"{self._title}: {name}"
        if self._bar is not None:
            self._bar.set_description_str(self._name, refresh=False)

    def _compiling(self, name: str) -> None:
        self._compiled += 1
        total = len(self._jit.kernel_names())
        text = f"compiling kernels (once only): {self._compiled} of at most {total}"
        if self._lines:
            if self._compiled % 10 == 1:
                print(f"{self._title}: {text}", file=sys.stderr, flush=True)
        elif self._bar is not None:
            self._bar.set_postfix_str(text)


def report_restart(show: bool | Callable[[float], None], old: Path) -> None:
    """Report that a file belongs to another case and the run starts from the beginning; only if progress is shown."""
    if show is True:
        print(f"{old} belongs to another case: the run starts from the beginning", file=sys.stderr, flush=True)


@contextmanager
def report_compilation(show: bool | Callable[[float], None], title: str, jit: Any) -> Iterator[None]:
    """Report once that kernels are compiled, before the progress of the run is shown."""
    reported = False

    def report(name: str) -> None:
        nonlocal reported
        if not reported:
            print(f"{title}: compiling kernels (once only)", file=sys.stderr, flush=True)
        reported = True

    unsubscribe = jit.on_compile(report) if show is True else lambda: None
    try:
        yield
    finally:
        unsubscribe()
