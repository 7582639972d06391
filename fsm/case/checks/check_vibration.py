"""Checks of a tensioned film that involve several sections."""

from __future__ import annotations

from collections.abc import Iterable

from fsm.case.checks.sections import Sections, method_faults, missing_sections, static_keys
from fsm.case.derived.membrane import check_film
from fsm.case.models.materials import Material
from fsm.case.models.membrane import CornerCable, Membrane
from fsm.errors import Fault
from fsm.text.shown_units import shown, shown_points

_OPPOSITE = {"left": "right", "right": "left", "bottom": "top", "top": "bottom"}
_SIDES = frozenset(_OPPOSITE)


def check_vibration(sections: Sections) -> list[Fault]:
    """Faults of a film and its vibration that involve several sections."""
    faults = [*_vibration_solve(sections)]
    if sections.stages == ("vibrate",):
        faults += [*missing_sections(sections, _NEEDED), *_slack(sections), *_held_points(sections)]
        faults += _film_damping(sections)
        if sections.case.membrane is not None:
            faults += check_film(sections.case.membrane, sections.listed["patch"])
    faults += _points(sections)
    return faults


_NEEDED = {
    "membrane": "it defines the film",
    "material": "it gives the material of the film",
    "tension": "without it the film is slack and cannot vibrate; give `pull` at the corners or `strain` of the edges",
}


def _slack(sections: Sections) -> Iterable[Fault]:
    """Tension that leaves the film slack."""
    tension, material = sections.case.tension, sections.case.material
    if tension is None:
        return
    if tension.pull is not None and not tension.pull > 0.0:
        yield Fault("tension.pull", f"must be greater than 0 N, or the film is slack; it is {tension.pull:g} N")
    if tension.strain is not None:
        strain = tension.strain if isinstance(tension.strain, tuple) else (tension.strain, tension.strain)
        nu = material.poisson if material is not None else 0.3
        stress = max(strain[0] + nu * strain[1], strain[1] + nu * strain[0])
        if not stress > 0.0:
            yield Fault("tension.strain", f"must give a tensile stress, or the film is slack; it is {_list(strain)}")
        elif max(strain) > 0.2:
            yield Fault("tension.strain", f"must be at most 0.2 (give 1e-3 for 0.1 %); it is {_list(strain)}")


def _list(values: Iterable[float]) -> str:
    return f"[{', '.join(f'{value:g}' for value in values)}]"


def _held_points(sections: Sections) -> Iterable[Fault]:
    """Supports that do not exist, and tension without a support that keeps it."""
    cables = [cable for cable in sections.listed["cable"].values() if isinstance(cable, CornerCable)]
    if len(cables) > 1:
        yield Fault("cable", f"{len(cables)} sections of corner cables are given; give one section")
    at = {support.at for support in sections.listed["support"].values()}
    for number, support in sections.listed["support"].items():
        if support.at == "cables" and not cables and "cable" not in sections.written:
            yield Fault(f"support.{number}.at", 'the film has no corner cables; add [[cable]] with place = "corners"')
        if support.position is not None and sections.case.membrane is not None:
            yield from _on_film(sections.case.membrane, support.position, f"support.{number}.position")
    if sections.case.tension is None or not at:
        return
    if sections.case.tension.pull is not None and not at & {"corners", "cables", "edges"}:
        yield Fault(
            "support",
            'no support keeps the tension of the corners (`tension.pull`); add a support at "corners", or remove all',
        )
    if sections.case.tension.strain is None:
        return
    sides = at & _SIDES
    if not sides and "edges" not in at:
        yield Fault(
            "support",
            'no support keeps the tension of the edges (`tension.strain`); add a support at "edges", or remove all',
        )
    elif len(sides) == 1 and len(at) == 1:
        (side,) = sides
        text = f'only the edge "{side}" is supported, so the film loses the tension of `tension.strain`'
        yield Fault("support", f'{text}; add a support at "{_OPPOSITE[side]}" or at "edges"')


def _film_damping(sections: Sections) -> Iterable[Fault]:
    material = sections.case.material
    for key, hint in (("damping", "give `damping.material` instead"), ("plate", "films bend as plates; remove this key")):
        if material is not None and getattr(material, key) != Material.model_fields[key].default:
            yield Fault(f"material.{key}", f"applies to the joints of a strip only; {hint}")


def _points(sections: Sections) -> Iterable[Fault]:
    """Probes and impact points outside the film."""
    film = sections.case.membrane
    if film is None:
        return
    if sections.case.impact is not None:
        yield from _on_film(film, sections.case.impact.point, "impact.point")
        half = 0.5 * (sections.case.impact.size or 0.0)
        reach = [abs(x) + half for x in sections.case.impact.point]
        if half and any(x > 0.5 * side * (1 + 1e-9) for x, side in zip(reach, (film.length, film.width), strict=True)):
            text = f"a square of {shown(2.0 * half, 'm')} around impact.point extends beyond the film; give a smaller square"
            yield Fault("impact.size", text)
    if sections.case.vibration is not None:
        for name, point in sections.case.vibration.probes.items():
            yield from _on_film(film, point, f"vibration.probes.{name}")


def _on_film(film: Membrane, point: tuple[float, float], path: str) -> Iterable[Fault]:
    half = (0.5 * film.length, 0.5 * film.width)
    if any(abs(x) > limit * (1 + 1e-9) for x, limit in zip(point, half, strict=True)):
        yield Fault(
            path,
            f"{shown_points([point])} is outside the film, whose corner is at "
            f"{shown_points([half])}; give a point on the film",
        )


def _vibration_solve(sections: Sections) -> Iterable[Fault]:
    """Keys of [solve] and [save] that a vibration does not use."""
    solve = sections.solve
    if sections.stages != ("vibrate",):
        return
    if solve is not None:
        if solve.method == "static":
            yield Fault("solve.method", 'a vibration is dynamic; give "generalized-alpha" or "auto"')
        if solve.spatial:
            yield Fault("solve.spatial", "a film always moves in space; remove this key")
        unused = dict.fromkeys(static_keys(solve), "a film has no drive")
        if solve.end_time is not None:
            unused = {"end_time": "`vibration.duration` gives the end"} | unused
        for key, reason in unused.items():
            yield Fault(f"solve.{key}", f'not used with analysis = "vibrate", because {reason}; remove this key')
        if solve.method != "auto":  # here "auto" means generalized-alpha
            yield from method_faults(solve)
    if sections.case.save.every is not None:
        yield Fault("save.every", "is a travel of a drive, and a film has no drive; give `interval` (time) instead")
