"""A bar that shows how far a run is: tqdm on a terminal, plain lines elsewhere, nothing when not wanted."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tqdm import tqdm

__all__ = ["Progress", "say_anew", "saying_what_compiles"]

_LINE_EVERY = 10.0
"""Seconds between plain lines."""


class Progress:
    """Progress of one run, as a context.

    Parameters
    ----------
    wanted : bool or callable
        A callable gets the fraction done instead.
    end : time at which the run is done, s
    title : what is running
    jit : the module `fsm.kernels.jit`, asked to tell when a kernel is compiled; None where there are no kernels
    """

    def __init__(
        self, wanted: bool | Callable[[float], None], end: float, title: str, jit: Any = None
    ) -> None:
        self._report = wanted if callable(wanted) else None
        self._lines = wanted is True and not sys.stderr.isatty()
        self._bar = tqdm(total=100.0, desc=title[:40], unit="%", disable=wanted is not True or self._lines)
        self._bar.bar_format = "{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}{postfix}"
        self._end, self._title, self._jit = end, title, jit
        self._told = time.monotonic()
        self._compiled = 0
        self._forget: Callable[[], None] | None = None
        self._visible = wanted is True

    def __enter__(self) -> Progress:
        if self._visible and self._jit is not None:
            self._forget = self._jit.on_compile(self._compiling)
        return self

    def __exit__(self, *exception: object) -> None:
        if self._forget is not None:
            self._forget()
        self._bar.close()

    def step(self, t: float, steps: int) -> None:
        """Tell the time reached (s) and the steps taken."""
        fraction = t / self._end
        if self._report is not None:
            self._report(fraction)
        if self._visible and not self._lines:
            self._bar.set_postfix_str(f"{steps} steps", refresh=False)
            self._bar.update(100.0 * fraction - self._bar.n)
        elif self._lines and time.monotonic() - self._told > _LINE_EVERY:
            self._told = time.monotonic()
            print(f"{self._title}: {100 * fraction:.0f} %, {steps} steps", file=sys.stderr, flush=True)

    def _compiling(self, name: str) -> None:
        self._compiled += 1
        total = len(self._jit.kernel_names())
        text = f"compiling kernels, once: {self._compiled} of at most {total}"
        if self._lines:
            if self._compiled % 10 == 1:
                print(f"{self._title}: {text}", file=sys.stderr, flush=True)
        else:
            self._bar.set_postfix_str(text)


def say_anew(wanted: bool | Callable[[float], None], left: Path) -> None:
    """Say that a run does not go on with what another case left, where progress is shown; results keep silent."""
    if wanted is True:
        print(f"{left} is of another case: begun anew", file=sys.stderr, flush=True)


@contextmanager
def saying_what_compiles(wanted: bool | Callable[[float], None], title: str, jit: Any) -> Iterator[None]:
    """Say once that kernels are compiled, where there is no progress yet to be shown: a run that is being prepared."""
    said = False

    def say(name: str) -> None:
        nonlocal said
        if not said:
            print(f"{title}: compiling kernels, once", file=sys.stderr, flush=True)
        said = True

    forget = jit.on_compile(say) if wanted is True else lambda: None
    try:
        yield
    finally:
        forget()
