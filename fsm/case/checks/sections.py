"""Sections of a case, for checks that involve several of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from fsm.case.models.case import Analysis, Case
from fsm.case.models.loads import Drive
from fsm.case.models.solve import Solve
from fsm.errors import Fault


@dataclass(frozen=True)
class Sections:
    """Sections of a case that are valid by themselves, and the names of all sections in the file.

    A section that is named in `written` and absent in `case` has other faults, and needs no further checks.

    Attributes
    ----------
    written : names of the sections in the file
    case : the valid sections; a section that is absent or faulty has its default
    listed : items of the sections that may appear several times, by their number in the file, from 0; without faulty ones
    stages : analyses of the case; empty if they cannot be read
    solve : settings of the solver; None if they are faulty
    faulty_steps : whether the file has faulty steps, which `listed` does not contain
    """

    written: frozenset[str]
    case: Case
    listed: Mapping[str, Mapping[int, Any]]
    stages: tuple[Analysis, ...]
    solve: Solve | None
    faulty_steps: bool

    @property
    def all_drives(self) -> list[tuple[str, Drive]]:
        """Drives of the case and of its steps, with their paths."""
        found = [(f"drive.{index}", drive) for index, drive in self.listed["drive"].items()]
        for number, step in self.listed["step"].items():
            found += [(f"step.{number}.drive.{index}", drive) for index, drive in enumerate(step.drive)]
        return found


def missing_sections(sections: Sections, needed: Mapping[str, str]) -> Iterable[Fault]:
    """Faults of missing sections; `needed` gives the reason for each."""
    for name, why in needed.items():
        if name not in sections.written:
            yield Fault(name, f"section [{name}] is missing; {why}")


def method_faults(solve: Solve | None) -> Iterable[Fault]:
    """Faults of keys that the chosen method does not use."""
    if solve is None or (solve.method == "generalized-alpha" and solve.branch is None):
        return
    if solve.method != "generalized-alpha" and solve.rho_inf is not None:
        yield Fault("solve.rho_inf", f'applies to method = "generalized-alpha", not to "{solve.method}"; remove this key')
    if solve.branch is not None and solve.method != "arc-length":
        text = f'is used by method = "arc-length" only, not by "{solve.method}"; remove this key'
        yield Fault("solve.branch", text)
    if solve.step is not None and solve.method not in ("newmark", "mean-force"):
        used = 'is used by method = "generalized-alpha", "mean-force" and "newmark" only'
        yield Fault("solve.step", f'{used}, not by "{solve.method}"; remove this key')


def static_faults(solve: Solve | None) -> Iterable[Fault]:
    """Faults of keys of statics with another method; "auto" may select statics."""
    if solve is None or solve.method in ("static", "auto"):
        return
    for key in static_keys(solve):
        text = f'is used by method = "static" and "auto" only, not by "{solve.method}"; remove this key'
        yield Fault(f"solve.{key}", text)


def static_keys(solve: Solve) -> list[str]:
    """Keys of statics with a value other than the default; complete case files also contain the defaults."""
    return [key for key in ("increment", "imperfection", "force_limit") if getattr(solve, key)]
