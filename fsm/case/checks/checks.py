"""Checks that involve several sections of a case."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import get_args

from fsm.case.checks.check_scissor import check_scissor
from fsm.case.checks.check_steps import check_steps
from fsm.case.checks.check_vibration import check_vibration
from fsm.case.checks.sections import Sections, method_faults, static_faults, static_keys
from fsm.case.models.case import Analysis, Strip, held_panels
from fsm.case.models.lattice import Edge
from fsm.case.models.loads import Drive
from fsm.errors import Fault
from fsm.text.shown_units import shown

_OF_STRIP = {"crease": "crease numbers", "panel": "panel numbers", "end": "ends"}
"""Keys of a drive that only a strip has."""
_ANY = ("title", "units", "analysis", "stages", "material", "gravity", "solve", "save", "report", "expect")
_DEPLOY = (
    "start", "release", "strip", "lattice", "sheet", "scene", "crease", "contact", "friction", "drive", "load", "step",
    "obstacle", "gas", "orifice", "margin", "event",
)  # fmt: skip
_FILM = ("membrane", "patch", "cable", "support", "tension")
_VIBRATE = ("air", "damping", "impact", "vibration")
_SCISSOR = ("scissor", "bar", "hinge", "stop", "hold", "force")
_READ: dict[tuple[Analysis, ...], tuple[str, ...]] = {
    ("deploy",): (*_ANY, *_DEPLOY),
    ("vibrate",): (*_ANY, *_FILM, *_VIBRATE),
    ("scissor",): (*_ANY, *_SCISSOR),
    ("deploy", "vibrate"): (*_ANY, *_DEPLOY, "deployed", *_VIBRATE),
}
"""Sections that each sequence of analyses uses."""


def check_sections(sections: Sections) -> list[Fault]:
    """All faults that involve several sections, for sections that are valid by themselves."""
    if not sections.stages:
        return []
    faults = list(_unused(sections))
    if "deploy" in sections.stages:
        faults += _check_deployment(sections)
    if "vibrate" in sections.stages:
        faults += check_vibration(sections)
    if "scissor" in sections.stages:
        faults += check_scissor(sections)
    return faults


def _unused(sections: Sections) -> Iterable[Fault]:
    """Sections that the analysis does not use."""
    read = _READ[sections.stages]
    named = f'analysis = "{sections.stages[0]}"' if len(sections.stages) == 1 else "these stages"
    if len(sections.stages) > 1 and sections.case.analysis != "deploy":
        yield Fault("analysis", "is given together with `stages`, which also sets the analysis; remove one of them")
    for name in sorted(sections.written - set(read)):
        homes = [stages for stages, names in _READ.items() if name in names]
        hint = " or ".join(f'analysis = "{home[0]}"' if len(home) == 1 else "`stages`" for home in homes)
        if homes:
            text = f"not used with {named}, because it belongs to {hint}; remove the section, or change the analysis"
            yield Fault(name, text)


def _check_deployment(sections: Sections) -> list[Fault]:
    return [
        *_missing_sections(sections),
        *_gas(sections),
        *_held_panels(sections),
        *_contact_pairs(sections),
        *_beside_scene(sections),
        *_strip_drives(sections),
        *_crease_of_strip(sections),
        *(drives_through_held_panels(sections, _held(sections)) if sections.case.strip is not None else ()),
        *_lattice_drives(sections),
        *_scene_drives(sections),
        *(() if "step" in sections.written else _repeated(sections.listed["drive"])),
        *_friction(sections),
        *_obstacles(sections),
        *_end(sections),
        *_force_limit(sections),
        *_release(sections),
        *check_steps(sections),
        *method_faults(sections.solve),
        *static_faults(sections.solve),
    ]


def _missing_sections(sections: Sections) -> Iterable[Fault]:
    given = [name for name in ("scene", "sheet", "lattice", "strip") if name in sections.written]
    if len(given) > 1 and given not in (["scene", "strip"], ["scene", "sheet"]):
        yield Fault(given[0], f"[{given[0]}] and [{given[1]}] both define a model; give one of them")
    elif not given:
        yield Fault("strip", "section [strip] is missing; give [strip], [lattice], [sheet], [wing] or [scene]")
    if given == ["lattice"]:
        for name in sorted({"material", "crease", "contact", "friction", "obstacle"} & sections.written):
            yield Fault(name, f"the squares of a lattice are rigid and have no contact; remove section [{name}]")
    for part in ("strip", "sheet"):
        for name in ("material", "crease") if part in sections.written else ():
            smooth = part == "sheet" and (sections.case.sheet is None or sections.case.sheet.has_no_creases)
            if name not in sections.written and not (smooth and name == "crease"):
                yield Fault(name, f"section [{name}] is missing; a {part} needs this section")


def _gas(sections: Sections) -> Iterable[Fault]:
    """Gas without a sheet whose nodes can carry it, and orifices without gas."""
    if "gas" in sections.written:
        if "sheet" not in sections.written:
            yield Fault("gas", "only a [sheet] has closed chambers; remove [[gas]], or give a [sheet]")
    elif "orifice" in sections.written:
        yield Fault("orifice", "[[orifice]] joins chambers of [[gas]], which is missing; add [[gas]], or remove [[orifice]]")


_ALSO_IN_SCENE = {
    "contact": "contact", "friction": "friction", "drive": "drives", "load": "loads", "obstacle": "obstacles",
}  # fmt: skip
"""Sections of a case, with the keys of [scene] that have the same meaning."""


def _beside_scene(sections: Sections) -> Iterable[Fault]:
    """Faults of sections that a [scene] does not use, and of values that are given twice."""
    scene = sections.case.scene
    if "scene" not in sections.written:
        return
    for name in sorted({"material", "crease"} & sections.written) if not {"strip", "sheet"} & sections.written else ():
        yield Fault(name, f"each body and element of a [scene] has its own [{name}]; remove this section")
    if scene is None:
        return
    for name, key in _ALSO_IN_SCENE.items():
        if name in sections.written and getattr(scene, key):
            yield Fault(name, f"is given here and as scene.{key}; remove one of them")
    if any(sections.case.gravity) and any(scene.gravity):
        yield Fault("gravity", "is given here and as scene.gravity; remove one of them")
    if scene.contact is not None and scene.contact.pairs is not None:
        yield Fault("scene.contact.pairs", "only a [strip] has panel numbers; give the pairs as `scene.pairs`")


def _held(sections: Sections) -> frozenset[int]:
    """Numbers of the held panels of the strip."""
    assert sections.case.strip is not None
    return held_panels(sections.case.strip, [drive for _, drive in sections.all_drives])


def _all_held(sections: Sections) -> bool:
    assert sections.case.strip is not None
    panels = sections.case.strip.panels
    return len(_held(sections) & set(range(1, panels + 1))) == panels


def _held_panels(sections: Sections) -> Iterable[Fault]:
    strip = sections.case.strip
    if strip is None:
        return
    for index, panel in enumerate(strip.held or ()):
        if not 1 <= panel <= strip.panels:
            yield Fault(
                f"strip.held.{index}", f"must be a panel number from 1 to {strip.panels}; it is {panel}"
            )
    if _all_held(sections):
        default = " (by default the first and the last)" if strip.held is None else ""
        yield Fault("strip.held", f"all {strip.panels} panels are held{default}, so none can move; hold fewer panels")


def _contact_pairs(sections: Sections) -> Iterable[Fault]:
    """Faults of contact pairs that name an unknown panel or the same panel twice."""
    strip, contact = sections.case.strip, sections.case.contact
    if contact is not None and contact.pairs is not None and "scene" in sections.written:
        yield Fault("contact.pairs", "only a [strip] has panel numbers; give the pairs of a [scene] as `scene.pairs`")
    if strip is None or contact is None:
        return
    for index, pair in enumerate(contact.pairs or ()):
        if pair[0] == pair[1] or not all(1 <= panel <= strip.panels for panel in pair):
            yield Fault(
                f"contact.pairs.{index}",
                f"must be two different panel numbers from 1 to {strip.panels}; it is [{pair[0]}, {pair[1]}]",
            )


def _strip_drives(sections: Sections) -> Iterable[Fault]:
    strip = sections.case.strip
    if strip is None or _all_held(sections):
        return
    for place, drive in sections.all_drives:
        yield from _gripped_panel(place, drive, strip)
        if drive.crease is None:
            continue
        path, last = f"{place}.crease", strip.panels - 1
        if not 1 <= drive.crease <= last:
            yield Fault(
                path,
                f"must be a crease number from 1 to {last}, with {strip.panels} panels; it is {drive.crease}",
            )
            continue
        held = sorted(_held(sections) & {drive.crease, drive.crease + 1})
        if held:
            panels = " and ".join(str(panel) for panel in held)
            what = f"panel {panels}, which is" if len(held) == 1 else f"panels {panels}, which are"
            source = "by default" if strip.held is None else "by `strip.held`"
            yield Fault(
                path,
                f"crease {drive.crease} is an edge of {what} held ({source}), so it cannot move; choose another crease",
            )


def _gripped_panel(place: str, drive: Drive, strip: Strip) -> Iterable[Fault]:
    """Faults of a drive of a panel or of an end, whose panel must exist and must not be held."""
    if drive.panel is not None and not 1 <= drive.panel <= strip.panels:
        yield Fault(f"{place}.panel", f"must be a panel number from 1 to {strip.panels}; it is {drive.panel}")
    key, panel = "panel" if drive.end is None else "end", drive.gripped(strip.panels)
    if panel in (strip.held or ()):
        text = f"panel {panel} is held by `strip.held`, so it cannot move; remove it from `strip.held`"
        yield Fault(f"{place}.{key}", text)


def _crease_of_strip(sections: Sections) -> Iterable[Fault]:
    """Keys of a crease that only a sheet uses."""
    if "strip" in sections.written and sections.case.crease is not None:
        for key, instead in (("stiffness_per_length", "stiffness"), ("width", "scale")):
            if getattr(sections.case.crease, key, None) is not None:
                yield Fault(f"crease.{key}", f"only a [sheet] uses it; give `{instead}` for the whole width of the strip")


def _lattice_drives(sections: Sections) -> Iterable[Fault]:
    if "lattice" in sections.written and sections.solve is not None and sections.solve.spatial:
        yield Fault("solve.spatial", "a lattice moves in its plane only; remove this key")
    for path, drive in sections.all_drives:
        if drive.edge is not None and not {"lattice", "sheet"} & sections.written:
            text = "only a [lattice] and a [sheet] have edges; give `crease` in a [strip], else `body` or `bodies`"
            yield Fault(f"{path}.edge", text)
        if drive.at is not None and "sheet" not in sections.written:
            yield Fault(f"{path}.at", "only a [sheet] has such places; give `crease` in a [strip], else `body` or `bodies`")
        for key in _OF_STRIP if {"lattice", "sheet"} & sections.written else ():
            if getattr(drive, key) is not None:
                yield Fault(f"{path}.{key}", f"only a [strip] has {_OF_STRIP[key]}; give `edge` in a [lattice] or [sheet]")
        if drive.edge is not None and drive.turn is not None and "sheet" not in sections.written:
            yield Fault(f"{path}.turn", "the edge of a [lattice] does not turn; give `travel`")
        facets = None if sections.case.sheet is None else sections.case.sheet.facets
        if drive.turn is not None and not drive.guide and facets not in (None, "flexible"):
            text = 'a turn without a guide is for flexible facets; remove `guide`, or give facets = "flexible"'
            yield Fault(f"{path}.guide", text)
        lattice = sections.case.lattice
        if "lattice" in sections.written and drive.edge is not None and drive.edge not in get_args(Edge):
            yield Fault(f"{path}.edge", f'must be "bottom", "top", "left" or "right" in a [lattice]; it is "{drive.edge}"')
        if lattice is not None and drive.edge in lattice.held_edges:
            text = f'edge "{drive.edge}" is held by `lattice.held`, so it cannot move; choose another edge'
            yield Fault(f"{path}.edge", text)


def _scene_drives(sections: Sections) -> Iterable[Fault]:
    scene = sections.case.scene
    if scene is None or {"strip", "sheet"} & sections.written:
        return
    held = {body.name for body in scene.bodies if body.held} | {"ground"}
    listed = [*sections.all_drives, *((f"scene.drives.{index}", drive) for index, drive in enumerate(scene.drives))]
    for path, drive in listed:
        for key, what in _OF_STRIP.items():
            if getattr(drive, key) is not None:
                yield Fault(f"{path}.{key}", f"only a [strip] has {what}; give `body` in a [scene]")
        for body in drive.moved if "step" not in sections.written else ():  # an earlier step may release the body
            if body in held:
                key = "body" if drive.body is not None else "bodies"
                yield Fault(
                    f"{path}.{key}", f'body "{body}" is held, so it cannot move; free it, or choose another body'
                )


def _repeated(drives: Mapping[int, Drive]) -> Iterable[Fault]:
    first: dict[str, int] = {}
    for index, drive in drives.items():
        targets = [f'body "{body}"' for body in drive.moved]
        targets += [f"crease {drive.crease}"] if drive.crease is not None else []
        targets += [drive.part] if drive.panel is not None or drive.end is not None else []
        targets += [f'edge "{drive.edge}"'] if drive.edge is not None else []
        targets += [f"{drive.at}"] if drive.at is not None else []
        for what in targets:
            if what in first:
                yield Fault(f"drive.{index}", f"{what} is already driven by drive.{first[what]}; remove one of them")
            first.setdefault(what, index)


def _friction(sections: Sections) -> Iterable[Fault]:
    scene = sections.case.scene
    in_scene = scene is not None and scene.contact is not None
    if "friction" in sections.written and "contact" not in sections.written and not in_scene:
        yield Fault(
            "friction",
            "[friction] requires [contact], which is missing; add [contact], or remove [friction]",
        )
    if scene is not None and scene.friction and not in_scene and "contact" not in sections.written:
        yield Fault(
            "scene.friction",
            "friction requires contact, which is missing; add [contact], or remove friction",
        )


def _obstacles(sections: Sections) -> Iterable[Fault]:
    in_scene = sections.case.scene is not None and sections.case.scene.contact is not None
    if "obstacle" in sections.written and "contact" not in sections.written and not in_scene:
        yield Fault("obstacle", "[[obstacle]] requires [contact], which is missing; add [contact], or remove [[obstacle]]")


def _end(sections: Sections) -> Iterable[Fault]:
    scene_unknown = "scene" in sections.written and sections.case.scene is None
    driven = "drive" in sections.written or bool(sections.case.scene and sections.case.scene.drives)
    if driven or scene_unknown or "step" in sections.written:
        return
    if sections.solve is not None:
        for key in static_keys(sections.solve):
            yield Fault(f"solve.{key}", "requires a [[drive]], which is missing; remove this key, or add a [[drive]]")
    if sections.solve is not None and sections.solve.end_time is None:
        yield Fault(
            "solve.end_time",
            "missing, and there is no [[drive]], so the run has no end; give one of them",
        )
    if sections.case.save.every is not None:
        yield Fault(
            "save.every",
            "is a travel of a drive, and there is no [[drive]]; give `interval` (time) instead",
        )


def _force_limit(sections: Sections) -> Iterable[Fault]:
    """Fault of `solve.force_limit` with a first drive that turns; its effort is a moment."""
    limited = sections.solve is not None and sections.solve.force_limit is not None
    scene_drives = sections.case.scene.drives if sections.case.scene is not None else ()
    first = [*sections.listed["drive"].values(), *scene_drives][:1]
    if limited and first and first[0].turn is not None:
        text = "the first drive has a `turn`, whose effort is a moment; remove this key, or give `travel`"
        yield Fault("solve.force_limit", text)


def _release(sections: Sections) -> Iterable[Fault]:
    """Faults of `release`: a drive is given too, or nothing moves before the end of the run."""
    if sections.case.release is None:
        return
    if "drive" in sections.written or (sections.case.scene is not None and sections.case.scene.drives):
        yield Fault("release", "cannot be used with a [[drive]], which starts at time zero; remove one of them")
    hold, end = sections.case.release.hold_time, sections.solve.end_time if sections.solve is not None else None
    if end is not None and hold >= end:
        yield Fault(
            "release.hold_time", f"must be shorter than solve.end_time, {end:g} s, or nothing moves; it is {hold:g} s"
        )


def drives_through_held_panels(sections: Sections, held: frozenset[int]) -> Iterable[Fault]:
    """Faults of guided crease lines whose straight path crosses a held panel, which contact makes impossible.

    Parameters
    ----------
    sections : Sections
    held : numbers of the held panels
    """
    strip, contact = sections.case.strip, sections.case.contact
    if strip is None or contact is None or contact.pairs is not None:
        return
    for path, drive in sections.all_drives:
        line = drive.line(strip.panels)
        if line is None or drive.travel is None or not drive.guide or not 0 <= line <= strip.panels:
            continue
        size = math.sqrt(sum(x * x for x in drive.direction))
        way = tuple(drive.travel * x / size for x in drive.direction[::2])
        start, what = strip.crease_point(line), f"crease {line}" if drive.end is None else drive.part
        for panel in sorted(held - {line, line + 1}):
            if not 1 <= panel <= strip.panels:
                continue
            part = _crossing(start, way, strip.crease_point(panel - 1), strip.crease_point(panel))
            if part is not None:
                travel = part * drive.travel
                yield Fault(
                    f"{path}.travel",
                    f"{shown(drive.travel, 'm')} lead {what} through panel {panel}, which is held; they "
                    f"meet at {shown(travel, 'm')}. Reduce the travel, or hold other panels",
                )


def _crossing(
    start: tuple[float, float], way: tuple[float, ...], one: tuple[float, float], other: tuple[float, float]
) -> float | None:
    """Fraction of a path at which the path crosses the line between two points; None if they do not cross."""
    along = other[0] - one[0], other[1] - one[1]
    apart = one[0] - start[0], one[1] - start[1]
    both = way[0] * along[1] - way[1] * along[0]
    if abs(both) <= 1e-12 * math.hypot(*way) * math.hypot(*along):
        return None
    part = (apart[0] * along[1] - apart[1] * along[0]) / both
    at = (apart[0] * way[1] - apart[1] * way[0]) / both
    return part if 0.0 < part <= 1.0 and 0.0 <= at <= 1.0 else None
