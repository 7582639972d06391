"""Reading of case files: from TOML to a checked `Case`, or to the list of all its faults."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, get_args

from pydantic import TypeAdapter, ValidationError

from fsm.case.checks.checks import check_sections
from fsm.case.checks.sections import Sections
from fsm.case.loading.data_files import with_files
from fsm.case.loading.overrides import Given, apply_overrides, split_override
from fsm.case.loading.toml_file import read_toml
from fsm.case.loading.toml_text import case_text
from fsm.case.models.case import Analysis, Case, contact_of_strip, root
from fsm.case.models.scene import Scene
from fsm.case.models.solve import Solve
from fsm.case.schema.faults import MOST_UNKNOWN, faults_of, unknown_key
from fsm.case.schema.units import SYSTEMS, did_you_mean
from fsm.errors import CaseError, Fault
from fsm.registry import BUILDERS, load_extensions
from fsm.text.short_repr import ShortRepr

SUMMARY_NUMBERS = (
    "peak_force", "peak_travel", "dynamic_peak_force", "dynamic_peak_travel", "largest_magnitude",
    "largest_magnitude_travel", "final_travel", "final_force", "contact_travel", "contact_force", "bending_travel",
    "bending_force", "dof", "steps", "newton_iterations", "energy_error", "energy_drift", "numerical_dissipation",
    "unstable_equilibria", "wall_time_s", "frequency_hz", "frequency_fft_hz", "frequency_resolution_hz", "decay_rate",
    "damping_ratio", "amplitude_center", "amplitude_patch",
)  # fmt: skip
"""Numbers of a summary, which are the keys of `[expect]`."""
_MOST_UNEXPECTED = 10
"""Largest number of messages about `[expect]`."""
_MOST_ITEMS = 20
"""Number of faulty items in a list of sections after which the remaining items are not checked."""
_MOST_FAULTS = 50
"""Largest number of messages about a case."""


@dataclass(frozen=True, repr=False)
class LoadedCase(ShortRepr):
    """Case with its source file.

    Attributes
    ----------
    case : Case
        All values in SI, with measured crease curves.
    text : str
        The case as TOML with overrides and defaults; this text gives the same case without other files.
    path : Path
        Case file.
    """

    case: Case
    text: str
    path: Path


def load_case(path: str | Path, overrides: Sequence[str] = ()) -> LoadedCase:
    """Read and check a case file.

    Parameters
    ----------
    path : str or Path
    overrides : sequence of str
        Dotted path and value, for example ``"strip.fold_angle=75 deg"``; the value is a TOML value or plain text. Items of a
        list have a number, ``drive.0.speed``. The value ``none`` removes a section or a key.

    Raises
    ------
    CaseError
        All faults of the file, of its crease data and of the overrides.
    """
    split = [split_override(text) for text in overrides]
    return load_tables(
        read_toml(path),
        [item for item in split if not isinstance(item, Fault)],
        Path(path),
        [item for item in split if isinstance(item, Fault)],
    )


def load_tables(
    tables: Mapping[str, Any],
    values: Iterable[tuple[str, str | Given]],
    path: Path,
    faults: Sequence[Fault] = (),
    label: str = "--set ",
) -> LoadedCase:
    """Check a case that is given as tables.

    Parameters
    ----------
    tables : mapping
        Tables from TOML.
    values : iterable of (dotted path, value)
        Values that are set in the tables; see `apply_overrides`.
    path : Path
        Case file, or its name in messages; names of data files are relative to its folder.
    faults : sequence of Fault
        Known faults, which are reported together with the faults of the case.
    label : str
        Text in front of the paths of `values` in messages.

    Raises
    ------
    CaseError
        All faults of the case.
    """
    data, unknown = apply_overrides(tables, values, label)
    case, found = read_case(data, path.parent)
    found = [*faults, *unknown, *found]
    if found or case is None:
        raise CaseError(first_faults(found), str(path))
    return LoadedCase(case, case_text(case), path)


def first_faults(faults: Sequence[Fault]) -> list[Fault]:
    """First faults of a case, and a message with the number of the remaining faults."""
    more = len(faults) - _MOST_FAULTS
    return list(faults) if more <= 0 else [*faults[:_MOST_FAULTS], Fault("", f"and {more:,} more mistakes")]


class SharedSections:
    """Sections that many cases have from one base case: each is validated once, and the cases share it.

    Parameters
    ----------
    base : tables of the base case
    """

    def __init__(self, base: Mapping[str, Any]) -> None:
        self._base = base
        self._read: dict[tuple[str, str], tuple[Any, list[Fault]]] = {}

    def read(self, name: str, data: Mapping[str, Any], system: str) -> tuple[Any, list[Fault]]:
        """Validated section of a case, as `_read_section`."""
        if data[name] is not self._base.get(name):
            return _read_section(name, data, system)
        if (name, system) not in self._read:
            self._read[name, system] = _read_section(name, data, system)
        value, faults = self._read[name, system]
        return dict(value) if isinstance(value, dict) else value, list(faults)


def read_case(
    data: Mapping[str, Any], folder: Path, shared: SharedSections | None = None
) -> tuple[Case | None, list[Fault]]:
    """Build a case from the tables of its file, section by section, so that all faults are found.

    Parameters
    ----------
    data : mapping
        Tables from TOML, with overrides.
    folder : Path
        Folder to which names of data files are relative.
    shared : SharedSections, optional
        Sections of a base case that other cases have too.

    Returns
    -------
    Case or None
        None if there are faults.
    list of Fault
    """
    units = data.get("units", "SI")
    system = units if isinstance(units, str) and units in SYSTEMS else "SI"
    data, added, begun = _with_extensions(data, folder)
    known = list(Case.model_fields)
    unknown = [key for key in data if key not in known and key not in added]
    faults = begun + [Fault(key, unknown_key(key, known)) for key in unknown[:MOST_UNKNOWN]]
    if len(unknown) > MOST_UNKNOWN:
        faults.append(Fault("", f"and {len(unknown) - MOST_UNKNOWN:,} more unknown keys"))
    valid: dict[str, Any] = {}
    read = _read_section if shared is None else shared.read
    for name in known:
        if name == "contact" and name in data and "strip" in data:
            data = {**data, name: contact_of_strip(data[name], valid.get("strip"), valid.get("material"))}
        if name in data:
            valid[name], found = read(name, data, system)
            faults += found
    data, found = _build(data, added, valid, system)
    faults += found
    data, found = _build_wing(data, valid)
    faults += found
    for name, part in valid.items():
        valid[name], found = with_files(part, folder, system, name)
        faults += found
    faults += check_sections(_sections(data, valid))
    faults += _margin_faults(valid)
    faults += _event_faults(valid, system)
    faults += expectation_faults(valid.get("expect") or ())
    if faults:
        return None, faults
    values = {name: value for name, value in valid.items() if name != "units"}
    values.update({name: tuple(values[name].values()) for name in _LISTS if name in values})
    return Case(**values), []


def _with_extensions(data: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], list[str], list[Fault]]:
    """Tables with absolute names of extension files, the sections of builders that extensions add, and the faults of
    extensions.
    """
    names = data.get("extensions", ())
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        return dict(data), [], []  # the section itself is faulty
    files, faults = load_extensions(names, folder)
    sections = [name for name in BUILDERS if name in data]
    return dict(data) | ({"extensions": list(files)} if names else {}), sections, faults


def _build(
    data: Mapping[str, Any], sections: Sequence[str], valid: dict[str, Any], system: str
) -> tuple[dict[str, Any], list[Fault]]:
    """Scene that a builder of an extension makes from its section, in place of a [scene]."""
    data = dict(data)
    faults: list[Fault] = []
    for name in sections:
        raw, builder = data.pop(name), BUILDERS[name]
        others = [f"[{other}]" for other in ("strip", "lattice", "sheet", "scene") if other in data]
        if others:
            text = f"[{name}] defines the whole scene and cannot be combined with {' and '.join(others)}; remove one of them"
            faults.append(Fault(name, text))
            continue
        section, found = _validate(TypeAdapter(builder.section), raw, {name: raw}, (name,), system)
        faults += found
        if section is None:
            continue
        try:
            valid["scene"] = builder.build(section, valid)
        except CaseError as error:
            faults += [Fault(f"{name}.{fault.path}" if fault.path else name, fault.message) for fault in error.faults]
        data["scene"] = {}
    return data, faults


def _build_wing(data: dict[str, Any], valid: dict[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """Tables of a case in which the bodies and joints of a [wing] are parts of its [scene]."""
    if "wing" not in data:
        return data, []
    from fsm.case.derived.wing_scene import wing_events, wing_faults, with_wing  # this module imports numpy

    wing, others = valid.pop("wing"), [name for name in ("strip", "lattice", "sheet") if name in data]
    faults = [Fault("wing", f"cannot be combined with [{name}]; remove one of them") for name in others]
    scene = valid.get("scene")
    if wing is not None and (scene is not None or "scene" not in data):
        faults += wing_faults(wing, scene)
        valid["scene"] = None if faults else with_wing(wing, scene)
        own = dict(enumerate(wing_events(wing), len(data.get("event", ()))))
        valid |= {"event": (valid.get("event") or {}) | own} if own else {}
    return {name: value for name, value in data.items() if name != "wing"} | {"scene": data.get("scene", {})}, faults


def _margin_faults(valid: Mapping[str, Any]) -> list[Fault]:
    """Margins of joints that are not in the scene."""
    asked, scene = valid.get("margin"), valid.get("scene")
    if not asked or not isinstance(scene, Scene):
        return [Fault("margin", "needs ideal joints, [[scene.joints]] or a [wing]")] if asked and scene is None else []
    from fsm.case.derived.joint_margin import margin_faults  # this module imports numpy

    return list(margin_faults(tuple(asked.values()), scene.joints))


def _event_faults(valid: Mapping[str, Any], system: str) -> list[Fault]:
    """Events with unknown words or names; those of a strip or sheet are known after its scene is built."""
    events, scene = valid.get("event"), valid.get("scene")
    if not events or not isinstance(scene, Scene) or any(valid.get(name) for name in ("strip", "lattice", "sheet")):
        return []
    from fsm.case.derived.event_words import event_faults  # this module imports the models of all parts

    return list(event_faults(tuple(events.values()), scene, system))


_LISTS = tuple(name for name in Case.model_fields if (place := root({}).step(name)) and place.is_list_of_sections())
"""Sections that may appear several times."""


@cache
def _adapter(name: str, item: bool) -> TypeAdapter[Any]:
    """Validator of a section, or of one item of a list of sections."""
    field = Case.model_fields[name]
    return TypeAdapter(get_args(field.annotation)[0] if item else field.rebuild_annotation())


def _read_section(name: str, data: Mapping[str, Any], system: str) -> tuple[Any, list[Fault]]:
    """One validated section, or None if it has faults; for a list of sections, its valid items by number."""
    raw = data[name]
    if name not in _LISTS or not isinstance(raw, list):
        return _validate(_adapter(name, False), raw, data, (name,), system)
    items: dict[int, Any] = {}
    faults: list[Fault] = []
    wrong = 0
    for index, entry in enumerate(raw):
        item, found = _validate(_adapter(name, True), entry, data, (name, index), system)
        faults += found
        wrong += bool(found)
        if wrong == _MOST_ITEMS and index + 1 < len(raw):
            unchecked = len(raw) - index - 1
            faults.append(Fault(name, f"{wrong} items have faults; the {unchecked:,} items after them were not checked"))
            break
        if item is not None:
            items[index] = item
    return items, faults


def _validate(
    adapter: TypeAdapter[Any], raw: Any, data: Mapping[str, Any], path: tuple[str | int, ...], system: str
) -> tuple[Any, list[Fault]]:
    try:
        return adapter.validate_python(raw, context={"units": system}), []
    except ValidationError as error:
        return None, faults_of(error, data, path, system, Case)


def _sections(data: Mapping[str, Any], valid: Mapping[str, Any]) -> Sections:
    return Sections(
        written=frozenset(name for name in data if data[name] != []),
        case=Case.model_construct(**{name: part for name, part in valid.items() if part is not None and name not in _LISTS}),
        listed={name: valid[name] if isinstance(valid.get(name), dict) else {} for name in _LISTS},
        stages=_stages(data, valid),
        solve=valid.get("solve") if "solve" in data else Solve(),
        faulty_steps="step" in data and len(data["step"] or ()) != len(valid.get("step") or ()),
    )


def _stages(data: Mapping[str, Any], valid: Mapping[str, Any]) -> tuple[Analysis, ...]:
    """Analyses of a case; empty if they cannot be read."""
    if "stages" in data:
        stages: tuple[Analysis, ...] | None = valid["stages"]
        return stages or ()
    chosen: Analysis | None = valid["analysis"] if "analysis" in data else "deploy"
    return (chosen,) if chosen else ()


def expectation_faults(names: Iterable[str]) -> list[Fault]:
    """Faults of names in `[expect]` that no summary has."""
    unknown = [name for name in names if name not in SUMMARY_NUMBERS]
    there = f"; the summary has {', '.join(SUMMARY_NUMBERS)}"
    return [
        Fault(f"expect.{name[:60]}", f"is not a number of the summary{did_you_mean(name[:60], SUMMARY_NUMBERS) or there}")
        for name in unknown[:_MOST_UNEXPECTED]
    ]
