"""Errors of the package, each with the exit code of the command line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

_LONGEST = 1000
"""Largest number of characters in a line of a message."""


class FsmError(Exception):
    """Base of every error that the package raises on purpose; `exit_code` is the exit code of the command line."""

    exit_code = 1


@dataclass(frozen=True)
class Fault:
    """One mistake in the input: its place and a message with the remedy.

    Parameters
    ----------
    path : str
        Dotted path of the wrong key, e.g. ``strip.thickness``.
    message : str
        Value with its unit, bound and remedy, in one line.
    value : value as given; None if it is missing or unknown
    unit : SI unit of the quantity; empty if it has none
    cause : error with more data, for a picture of the fault
    """

    path: str
    message: str
    value: object = field(default=None, compare=False, repr=False)
    unit: str = field(default="", compare=False, repr=False)
    cause: Exception | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.path}: {self.message}" if self.path else self.message


class CaseError(FsmError):
    """Error of the input, with all faults found and not only the first.

    Parameters
    ----------
    faults : iterable of Fault, Fault or str
    source : str
        File with the faults; it is printed in front of each line.
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


@contextmanager
def fault_at(path: str, source: str = "") -> Iterator[None]:
    """Raise a `ValueError` of the block as the fault of a place in a case."""
    try:
        yield
    except ValueError as error:
        raise CaseError(Fault(path, str(error)), source) from None


def _one_line(text: str) -> str:
    """Message of bounded length without control characters, which names and values of a case may contain."""
    plain = re.sub(r"[\x00-\x1f\x7f-\x9f]+", " ", text)
    return plain if len(plain) <= _LONGEST else f"{plain[:_LONGEST - 3]}..."


class CannotWrite(FsmError):
    """Error of a file that cannot be written, for example because the disk is full or the folder is read-only."""

    exit_code = 2


class NotConverged(FsmError):
    """Error of a solver that stopped; the message names the worst body, joint or contact and a remedy."""

    exit_code = 3


class ExpectationFailed(FsmError):
    """Error of a result that is outside the bounds given in ``[expect]``."""

    exit_code = 4


class OutOfMemory(FsmError):
    """Error of a model that is larger than the memory of this computer."""

    exit_code = 3

    def __init__(self, error: MemoryError) -> None:
        found = f" ({' '.join(str(error).split())})" if str(error) else ""
        super().__init__(f"out of memory{found}; make the mesh coarser or save less often; in a table, use fewer workers")


def is_interrupt(error: BaseException) -> bool:
    """Whether an error comes from Ctrl-C."""
    return isinstance(raised_by_signal(error), KeyboardInterrupt)


def raised_by_signal(error: BaseException) -> BaseException:
    """Error that a signal handler raised; compiled kernels wrap it in a SystemError at each call level."""
    while isinstance(error, SystemError) and error.__cause__ is not None:
        error = error.__cause__
    return error


class NotInResult(FsmError, KeyError):
    """Error of a quantity that the result does not have."""

    exit_code = 2

    def __str__(self) -> str:
        return str(self.args[0])


class EnergyAbort(FsmError):
    """Error of an energy balance residual above its bound; the result is not reliable."""

    exit_code = 5
