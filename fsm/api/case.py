"""Cases in Python: read, change, check and run them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fsm.api.result import RESULT_FILE, Results
from fsm.case.loading.load_case import LoadedCase, load_tables
from fsm.case.loading.overrides import Given, apply_overrides, check_path
from fsm.case.loading.toml_file import is_too_deep, parse_toml, read_toml
from fsm.case.schema.model import Model
from fsm.errors import CaseError, ExpectationFailed, Fault

if TYPE_CHECKING:
    from fsm.analyses.of_record import SystemOfRecord
    from fsm.case.models.sheet import Sheet
    from fsm.studies.sensitivity import Sensitivity

_NAME = "case"
"""Name of a case without a file, in messages."""
_SECTIONS = {
    "strip": lambda part: f"strip of {part.panels} panels",
    "lattice": lambda part: f"lattice of {part.columns} x {part.rows} squares",
    "sheet": lambda part: _sheet_text(part),
    "membrane": lambda part: f"film of {part.length:g} m x {part.width:g} m",
    "scissor": lambda part: f"array of {part.units} scissor units",
}
_LISTS = {
    "bodies": ("body", "bodies"), "films": ("film", "films"), "cables": ("cable", "cables"), "beams": ("beam", "beams"),
    "trusses": ("truss", "trusses"), "elements": ("force element", "force elements"),
}  # fmt: skip
"""Lists of a scene, with their words for one item and for several."""


def _sheet_text(sheet: Sheet) -> str:
    facets = {"rigid": "rigid facets", "flexible": "flexible facets"}.get(sheet.facets, sheet.facets)
    if sheet.kind is not None:
        return f"{sheet.kind} sheet with {facets}"
    return f"sheet of {len(sheet.faces or ())} {facets}" if sheet.faces else f"sheet with {facets}"


def load(case: str | Path | Mapping[str, Any], *, folder: str | Path | None = None) -> Case:
    """Read and check a case.

    Parameters
    ----------
    case : path, text or mapping
        A path of a case file; TOML text, which has a line break or a "="; or a mapping with the tables of the file. Values
        are as in the file: ``"80 deg"`` or plain numbers. NumPy arrays and models such as `Strip` are accepted, too.
    folder : str or Path, optional
        Folder to which names of data files are relative. Absent: the folder of the case file, or the current folder.

    Raises
    ------
    CaseError
        All faults of the case, each with its path, value, unit and remedy.

    Examples
    --------
    >>> import fsm
    >>> case = fsm.load("folding_cases/strip_trial/case.toml")
    >>> case.set("strip.fold_angle", "70 deg")["strip.fold_angle"]
    1.2217304763960306
    """
    if isinstance(case, Mapping):
        _check_units(case, case.get("units", "SI"))
        tables, path = _plain(case), Path(_NAME)
        if is_too_deep(tables):
            raise CaseError("lists or sections are nested too deep; a case needs fewer than 10 levels", _NAME)
    elif isinstance(case, str) and ("\n" in case or "=" in case) and not _is_file(case):
        tables, path = parse_toml(case, _NAME), Path(_NAME)
    elif isinstance(case, str | Path):
        tables, path = read_toml(case), Path(case)
    else:
        raise CaseError(f"a case is a path, a text or a dict, not {type(case).__name__}", _NAME)
    return Case.from_tables(tables, path if folder is None else Path(folder) / path.name)


class Case:
    """Checked case; it does not change, and `set` returns another one.

    Attributes
    ----------
    model : fsm.case.models.case.Case
        All sections with values in SI.
    path : Path
        Case file, or the name "case".
    text : str
        The complete case as TOML in SI with all defaults; it needs no other files.

    Examples
    --------
    >>> import fsm
    >>> case = fsm.load("folding_cases/strip_trial/case.toml")
    >>> case
    Case('folding_cases/strip_trial/case.toml', 'trial strip': deploy, strip of 6 panels, 1 drive)
    >>> case["drive.0.travel"]
    0.04
    """

    def __init__(self, loaded: LoadedCase, tables: Mapping[str, Any]) -> None:
        self._loaded = loaded
        self._tables = tables

    @classmethod
    def from_tables(cls, tables: Mapping[str, Any], path: Path) -> Case:
        """Check tables as read from TOML; `path` gives the name in messages and the folder of data files."""
        return cls(load_tables(tables, (), path), tables)

    @property
    def model(self) -> Any:
        """All sections with values in SI."""
        return self._loaded.case

    @property
    def path(self) -> Path:
        """Case file, or the name "case"."""
        return self._loaded.path

    @property
    def text(self) -> str:
        """Complete case as TOML in SI with all defaults."""
        return self._loaded.text

    def set(self, path: str | Mapping[str, Any], value: Any = None) -> Case:
        """Copy of the case with other values.

        Parameters
        ----------
        path : str or mapping
            Dotted path as for ``--set``, for example ``"drive.0.speed"``. A mapping from paths to values sets several
            values at once.
        value : object
            Value as in a case file: ``"70 deg"``, a plain number in the unit system of the case, a list, or a dict for a
            section. None removes the key or the section.

        Raises
        ------
        CaseError
            The path is impossible, or the changed case has faults.
        """
        pairs = path if isinstance(path, Mapping) else {path: value}
        _check_units(pairs, self._tables.get("units", "SI"))
        values = [(str(key), Given(_plain(item))) for key, item in pairs.items()]
        tables, faults = apply_overrides(self._tables, values, "")
        if faults:
            raise CaseError(faults, str(self.path))
        return Case.from_tables(tables, self.path)

    def __getitem__(self, path: str) -> Any:
        """Value at a dotted path, in SI; a section is a model.

        Raises
        ------
        CaseError
            A case has no such key.
        """
        problem = check_path(path)
        if problem:
            raise CaseError(f"{path}: {problem}", str(self.path))
        here: Any = self.model
        for walked, key in enumerate(path.split("."), 1):
            if here is None or (key.isdigit() and int(key) >= len(here)):
                raise CaseError(f"{'.'.join(path.split('.')[:walked])}: the case has no such item", str(self.path))
            here = here[int(key)] if key.isdigit() else here[key] if isinstance(here, Mapping) else getattr(here, key, None)
        return here

    def check(self) -> CaseCheck:
        """Describe the model without solving it: its parts, parts left out with the reason, and approximations.

        Raises
        ------
        CaseError
            Faults that are found only when the model is compiled.
        """
        from fsm.check.report import describe

        try:
            return CaseCheck(tuple(describe(self.model)))
        except CaseError as error:
            raise CaseError(error.faults, error.source or str(self.path)) from None

    def run(
        self,
        out: str | Path | None = None,
        *,
        channels: str | Iterable[str] | None = None,
        figures: bool | None = None,
        progress: bool = False,
        resume: bool = False,
    ) -> Result:
        """Solve the case.

        Parameters
        ----------
        out : str or Path, optional
            Folder for the files of the run, as for ``fsm run --out``. Absent: a temporary folder, which exists as long as
            the result.
        channels : pattern or patterns, optional
            Channels to record, instead of ``save.channels``: ``"crease.*.moment"``.
        figures : bool, optional
            Whether to draw figures; absent: only with `out`.
        progress : bool
            Whether to show a bar on standard error.
        resume : bool
            Whether to continue an interrupted run in `out`.

        Raises
        ------
        CaseError
            The case has faults; no file was written.
        CannotWrite
            A file cannot be written.
        NotConverged, EnergyAbort
            The solve stopped.
        ExpectationFailed
            A number is outside its bounds in ``[expect]``; its attribute `result` is the complete result.
        """
        from fsm.io.threads import one_thread

        if channels is not None:
            patterns = [channels] if isinstance(channels, str) else list(channels)
            return self.set("save.channels", patterns).run(out, figures=figures, progress=progress, resume=resume)
        with one_thread():
            from fsm.run.run_case import run_case

        kept = tempfile.TemporaryDirectory(prefix="fsm-") if out is None else None
        folder = Path(kept.name if kept else out)  # type: ignore[arg-type]
        drawn = out is not None if figures is None else figures
        with one_thread():
            try:
                run_case(self._loaded, folder, progress=progress, resume=resume, figures=drawn)
            except ExpectationFailed as error:
                error.result = Result(folder, kept, allow_extensions=True)  # type: ignore[attr-defined]
                raise
            except CaseError as error:
                raise CaseError(error.faults, error.source or str(self.path)) from None
        return Result(folder, kept, allow_extensions=True)

    def sensitivity(
        self, of: str = "peak_force", by: Iterable[str] = (), *, study: str | Path | None = None, workers: int | None = 1
    ) -> Sensitivity:
        """Derivatives of a response with respect to numbers of the case, as ``fsm sensitivity``.

        Parameters
        ----------
        of : str
            Number of the summary, or ``"max of CHANNEL"``.
        by : iterable of str
            Dotted paths of numbers; absent: the parameters of the study.
        study : str or Path, optional
            Study file with the scatter of the numbers.
        workers : int, optional
            Number of processes for differences of runs; None: one for each core.

        Raises
        ------
        CaseError
            A path has no number, or the case has no such response.
        FsmError
            A run failed.

        Examples
        --------
        >>> import fsm
        >>> case = fsm.load("folding_cases/strip_trial/case.toml").set("strip.segments_per_panel", 2)
        >>> found = case.set("drive.0.travel", "2 mm").sensitivity(by=["material.young", "crease.stiffness"])
        >>> found["material.young"].exact
        True
        """
        from fsm.io.threads import one_thread

        with one_thread():
            from fsm.studies.sensitivity import sensitivity

            return sensitivity(self._tables, self.path, of, list(by), (), None if study is None else Path(study), workers)

    def solve_for(
        self, reach: str, by: str, between: tuple[float | str, float | str], out: str | Path | None = None
    ) -> Case:
        """Case with the value of a number for which a response has a given value, as ``fsm solve-for``.

        Parameters
        ----------
        reach : str
            Response and value: ``"peak_force=5 N"``.
        by : str
            Dotted path of the number.
        between : (value, value)
            Two values of the number on either side of the solution, as in a case file.
        out : str or Path, optional
            Folder for the history; absent: none is kept.

        Raises
        ------
        CaseError
            An argument is faulty, or the target is not between the responses at both ends.
        NotConverged
            A run failed, or the response jumps over the target.
        """
        from fsm.io.threads import one_thread

        with one_thread(), tempfile.TemporaryDirectory(prefix="fsm-") as folder:
            from fsm.studies.solve_for import solve_for

            kept = Path(folder if out is None else out)
            value, search = solve_for(self._tables, self.path, reach, by, between, kept, progress=False)
        return self.set(by, f"{value!r} {search.problem.units[by]}".strip())

    def write(self, path: str | Path) -> Path:
        """Write the complete case as a TOML file, which needs no other files; return its path."""
        from fsm.io.atomic_write import atomic_write

        with atomic_write(path) as part:
            part.write_text(self.text, encoding="utf-8")
        return Path(path)

    def __repr__(self) -> str:
        title = f", {self.model.title!r}" if self.model.title else ""
        return f"Case({str(self.path)!r}{title}: {', '.join(self._parts())})"

    def _repr_html_(self) -> str:
        title = escape(self.model.title or str(self.path))
        return f"<div><b>{title}</b>: {escape(', '.join(self._parts()))}</div>"

    def _parts(self) -> list[str]:
        """Analyses and parts of the model, in words."""
        case = self.model
        parts = [" and ".join(case.steps)]
        parts += [text(getattr(case, name)) for name, text in _SECTIONS.items() if getattr(case, name) is not None]
        if case.scene is not None:
            counts = {key: len(getattr(case.scene, key)) for key in _LISTS}
            parts += [f"{count} {_LISTS[key][count > 1]}" for key, count in counts.items() if count]
        for name in ("drive", "load", "step"):
            count = len(getattr(case, name))
            parts += [f"{count} {name}{'s' if count > 1 else ''}"] if count else []
        return parts


def open_result(result: str | Path, *, allow_extensions: bool = False) -> Result:
    """Read the result of a run; ``fsm.open`` is this function.

    Parameters
    ----------
    result : str or Path
        Folder of a run, or its file result.h5 (of an unfinished run result.part.h5).
    allow_extensions : bool
        Let `Result.case` execute the Python files that the case names as extensions. A result from somebody else can name
        any file of this computer.

    Raises
    ------
    CaseError
        The file is missing, damaged, or of another version.

    Examples
    --------
    >>> import fsm
    >>> case = fsm.load("folding_cases/rotating_squares/case.toml").set("drive.0.travel", 0.14)
    >>> folder = case.run().path  # doctest: +SKIP
    >>> fsm.open(folder).force().force.max()  # doctest: +SKIP
    """
    return Result(Path(result), allow_extensions=allow_extensions)


class Result(Results):
    """Result of a run.

    Attributes
    ----------
    path : Path
        Folder of the files. A folder of a run without `out` is removed with the result.
    solution : Solution
        All records as arrays in SI. A run of two stages has one for each stage, see `stages`.
    summary : dict
        Numbers of summary.json, SI.
    stages : dict of Result
        Results of the stages of a run, "deploy" and "vibrate"; empty for other runs.

    Examples
    --------
    >>> import fsm
    >>> result = fsm.load("folding_cases/rotating_squares/case.toml").set("drive.0.travel", 0.14).run()
    >>> travel, force = result.force()
    >>> round(float(travel[-1]), 6)
    0.00014
    >>> result["energy.creases"].unit
    'J'
    """

    @property
    def case(self) -> Case:
        """Case that was solved.

        Raises
        ------
        CaseError
            The case has extensions, and the result was opened without ``allow_extensions=True``; nothing was executed.
        """
        source = self._solution or next(iter(self.stages.values())).solution
        name = str(self.path / RESULT_FILE)
        tables = parse_toml(source.layout.case_text, name)
        if tables.get("extensions") and not self._allow_extensions:
            files = ", ".join(str(file).partition("#")[0] for file in tables["extensions"])[:200]
            text = (
                f"this case executes Python files ({files}), and none was executed; if you trust them, open the result with "
                "fsm.open(..., allow_extensions=True)"
            )
            raise CaseError([Fault("extensions", text)], name)
        return Case.from_tables(tables, Path(name))

    def system(self, record: int = -1) -> SystemOfRecord:
        """System of the model in a saved state, for forces, stiffness and energies there.

        The system has the multipliers of locked directions, the hysteresis and the latches of the state; one from
        `fsm.compile_scene` has those of the start.

        Parameters
        ----------
        record : int
            Number of the record, from 0; negative numbers count from the end.

        Returns
        -------
        SystemOfRecord
            ``system, time, q, u``; at rest ``system.observe(time, q, None).drive.force`` are the forces of the drives.

        Raises
        ------
        CaseError
            The result has no such record; an earlier version has written it, without internal variables; or the step has
            contact, whose internal variables are not stored.
        """
        from fsm.analyses.of_record import system_of_record

        return system_of_record(self.case.model, self.solution, record, str(self._file))


class CaseCheck:
    """Report of `Case.check`: lines of text, as ``fsm check`` prints them.

    Attributes
    ----------
    lines : tuple of str

    Examples
    --------
    >>> import fsm
    >>> report = fsm.load("folding_cases/strip_trial/case.toml").check()
    >>> any("drive" in line for line in report.lines)
    True
    """

    def __init__(self, lines: tuple[str, ...]) -> None:
        self.lines = lines

    def __str__(self) -> str:
        return "\n".join(self.lines)

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def _is_file(text: str) -> bool:
    try:
        return "\n" not in text and Path(text).is_file()
    except (OSError, ValueError):
        return False


def _check_units(value: Any, units: object) -> None:
    """Refuse models in a case whose plain numbers are not in SI.

    Raises
    ------
    CaseError
    """
    if units == "SI":
        return
    items = value.values() if isinstance(value, Mapping) else value if isinstance(value, list | tuple) else ()
    for item in items:
        if isinstance(item, Model):
            text = f'{type(item).__name__} has values in SI, and plain numbers of the case are in "{units}"; give a dict'
            raise CaseError(text, _NAME)
        _check_units(item, units)


def _plain(value: Any) -> Any:
    """Value as TOML has it: NumPy numbers, arrays, tuples, paths and models become numbers, lists, texts and tables."""
    if isinstance(value, Model):
        return _plain(value.model_dump(exclude_none=True))
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items() if item is not None}
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist") and hasattr(value, "dtype"):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
