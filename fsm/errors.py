"""What can go wrong, each with the exit code the command line gives it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = [
    "CannotWrite", "CaseError", "EnergyAbort", "ExpectationFailed", "Fault", "FsmError", "NotConverged", "is_interrupt",
    "raised_by_signal",
]  # fmt: skip


_LONGEST = 1000
"""Letters of a line of a message, at most."""


class FsmError(Exception):
    """Base of every error raised on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


@dataclass(frozen=True)
class Fault:
    """One mistake in the input: where, what, and what to do.

    Parameters
    ----------
    path : str
        Dotted path of the offending key, e.g. ``strip.thickness``.
    message : str
        The value, its unit and what to do, in one line.
    """

    path: str
    message: str

    def __str__(self) -> str:
        return f"{self.path}: {self.message}" if self.path else self.message


class CaseError(FsmError):
    """The input is wrong. Carries all faults found, not only the first.

    Parameters
    ----------
    faults : iterable of Fault
    source : str
        File the faults were found in; printed in front of each line.
    """

    exit_code = 2

    def __init__(self, faults: Iterable[Fault] | Fault | str, source: str = "") -> None:
        if isinstance(faults, str):
            faults = (Fault("", faults),)
        elif isinstance(faults, Fault):
            faults = (faults,)
        self.faults: tuple[Fault, ...] = tuple(faults)
        self.source = source
        super().__init__("\n".join(self.lines()))

    def lines(self) -> list[str]:
        """One line a fault, ``source: path: message``."""
        head = f"{self.source}: " if self.source else ""
        return [_one_line(f"{head}{fault}") for fault in self.faults]


def _one_line(text: str) -> str:
    """A message without control characters, which keys, names and values of a user may hold, and of bounded length."""
    plain = re.sub(r"[\x00-\x1f\x7f-\x9f]+", " ", text)
    return plain if len(plain) <= _LONGEST else f"{plain[:_LONGEST - 3]}..."


class CannotWrite(FsmError):
    """A file cannot be written: no room, or no right to."""

    exit_code = 2


class NotConverged(FsmError):
    """The solver stopped; the message names the worst body, joint or contact and what to try."""

    exit_code = 3


class ExpectationFailed(FsmError):
    """A number named in ``[expect]`` was missed."""

    exit_code = 4


def is_interrupt(error: BaseException) -> bool:
    """Whether somebody pressed Ctrl-C."""
    return isinstance(raised_by_signal(error), KeyboardInterrupt)


def raised_by_signal(error: BaseException) -> BaseException:
    """What a signal's handler raised: each call of a compiled kernel that it passes through makes a SystemError of it."""
    while isinstance(error, SystemError) and error.__cause__ is not None:
        error = error.__cause__
    return error


class EnergyAbort(FsmError):
    """The energy balance left its bound; the result cannot be trusted."""

    exit_code = 5
