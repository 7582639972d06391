"""Report of `fsm check` for a vibration: the model, the parts left out, and the approximations; nothing is compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

from fsm.case.derived.membrane import mesh_lines, place_patches
from fsm.case.models.case import Case
from fsm.case.models.membrane import CornerCable, MeasuredPulse, Vibration
from fsm.text.shown_units import count, labelled, material_text, shown, shown_points, shown_range, shown_size

MINAMI = 0.68
"""Height of the air layer of the added mass, relative to the length of the film; `fsm.model.nodes.films.air` has the
source."""


def describe_film(case: Case) -> list[str]:
    """Lines of the report: the model, the parts left out with the reason, and the approximations."""
    return labelled(_DEPLOYED if case.stages else _SECTIONS, case)


def _title(case: Case) -> Iterator[str]:
    if case.title:
        yield case.title


def _steps(case: Case) -> Iterator[str]:
    end = (case.vibration or Vibration()).duration if case.impact is not None else 0.0
    yield f"1 vibrate: dynamic, 0 to {end:.4g} s" if end else "1 vibrate: dynamic, at 0 s; without [impact] nothing moves"


def _film(case: Case) -> Iterator[str]:
    film, material = case.membrane, case.material
    assert film is not None and material is not None
    yield f"{shown_size(film.length, film.width, film.thickness)}, areal mass {_areal(case):.4g} kg/m^2"
    yield material_text(material.young, material.poisson, material.density)


def _areal(case: Case) -> float:
    assert case.membrane is not None and case.material is not None
    return case.material.density * case.membrane.thickness


def _mesh(case: Case) -> Iterator[str]:
    assert case.membrane is not None
    placed = place_patches(case.membrane, dict(enumerate(case.patch)))
    lines = mesh_lines(case.membrane, placed)
    columns, rows = len(lines.x) - 1, len(lines.y) - 1
    given = case.membrane.mesh
    added = "" if (columns, rows) == given else f" ({given[0]} x {given[1]} by mesh, and lines at the edges of patches)"
    sides = [b - a for along in (lines.x, lines.y) for a, b in pairwise(along)]
    yield f"{columns} x {rows} ANCF elements of {shown_range(min(sides), max(sides), 'm')}{added}"
    cables = sum(4 * cable.elements for cable in case.cable if isinstance(cable, CornerCable))
    cables += sum(2 * (columns + rows) for cable in case.cable if not isinstance(cable, CornerCable))
    nodes = (columns + 1) * (rows + 1)
    more = f", {count(cables, 'cable element')}" if cables else ""
    yield f"{nodes} film nodes of 9 coordinates (position and two slopes){more}"


def _patches(case: Case) -> Iterator[str]:
    assert case.membrane is not None
    placed = place_patches(case.membrane, dict(enumerate(case.patch)))
    for number, patch in enumerate(case.patch):
        here = [one for one in placed if one.number == number]
        mass = patch.density * patch.thickness * patch.size**2
        where = shown_points((one.x, one.y) for one in here[:4]) + (", ..." if len(here) > 4 else "")
        yield (
            f"{count(len(here), 'patch', 'patches')} of {shown_size(patch.size, patch.size, patch.thickness)}, "
            f"E {shown(patch.young, 'Pa')}, {shown(mass, 'kg')} each, at {where}"
        )


def _cables(case: Case) -> Iterator[str]:
    for cable in case.cable:
        if isinstance(cable, CornerCable):
            kind = f"from each corner outwards, {shown(cable.length, 'm')} long"
            joined = "joined to the film by position only"
        else:
            kind, joined = "along the edges", "joined to the film by position and slope"
        made = f"diameter {shown(cable.diameter, 'm')}, E {shown(cable.young, 'Pa')}, {cable.density:g} kg/m^3"
        yield f"{kind}, {made}; {joined}"


def _support(case: Case) -> Iterator[str]:
    if not case.support:
        tips = any(isinstance(cable, CornerCable) for cable in case.cable)
        pulled = case.tension is not None and case.tension.pull is not None
        yield ("outer ends of the cables" if tips else "corners" if pulled else "all edges") + " (default support)"
    for support in case.support:
        where = "" if support.position is None else f" {shown_points([support.position])}"
        yield f"{support.at}{where}, {', '.join(support.fixed)}" + (", with slopes" if support.clamped else "")


def _tension(case: Case) -> Iterator[str]:
    tension = case.tension
    assert tension is not None
    if tension.pull is not None:
        yield f"{shown(tension.pull, 'N')} at every corner, outwards along the diagonal; the supports then keep this state"
    else:
        strain = tension.strain if isinstance(tension.strain, tuple) else (tension.strain, tension.strain)
        yield f"edges moved outwards by the strains {strain[0]:g}, {strain[1]:g}; the supports then keep this state"
    yield {
        "plain": "plain film: it carries compression; if it wrinkles, the run stops with an error",
        "tension-field": "tension field: the film carries no compression; stresses are averages over wrinkles",
        "auto": "auto: plain film if it is stable and its principal stresses are tensile everywhere, else tension field",
        "wrinkles": "wrinkles: resolved by the mesh, starting from an initial imperfection",
    }[tension.film]


def _air(case: Case) -> Iterator[str]:
    if case.air is None or case.membrane is None:
        return
    mass = MINAMI * case.air.density * (case.air.length or case.membrane.length)
    ratio = mass / _areal(case)
    yield (
        f"added mass {mass:.4g} kg/m^2 for the normal motion, {ratio:.3g} times the mass of the film (Minami); the "
        f"frequency of a film without patches is {(1.0 + ratio) ** -0.5:.3g} times its frequency in vacuum"
    )


def _damping(case: Case) -> Iterator[str]:
    if case.damping is None:
        return
    if case.damping.material:
        yield f"Kelvin-Voigt, {case.damping.material:g} s, in film, patches and cables"
    if case.damping.air:
        yield f"air: {case.damping.air:g} 1/s x mass x velocity; amplitudes decay as exp(-{0.5 * case.damping.air:g} t)"


def _impact(case: Case) -> Iterator[str]:
    impact = case.impact
    if impact is None:
        return
    at = f"at {shown_points([impact.point])}, normal to the film"
    if isinstance(impact, MeasuredPulse):
        yield f"measured pulse, {len(impact.time)} points up to {impact.time[-1]:g} s, {at}"
    else:
        yield f"{impact.pulse} of {shown(impact.force, 'N')} for {shown(impact.duration, 's')} {at}"


def _computed(case: Case) -> Iterator[str]:
    vibration = case.vibration or Vibration()
    yield f"tensioned state, and {count(vibration.modes, 'natural mode')} about it"
    if case.impact is not None:
        yield f"{vibration.duration:g} s of vibration; resolution of spectra {1.0 / vibration.duration:.3g} Hz or coarser"
        names = {"center": None, **({"patch": None} if case.patch else {}), **vibration.probes}
        yield f"probes: {', '.join(names)}"


def _left_out(case: Case) -> Iterator[str]:
    if case.impact is None:
        yield "impact: no [impact]; only the tensioned state and its modes are computed"
    if case.air is None:
        yield "air: no [air]; the film vibrates in vacuum"
    if case.damping is None or not (case.damping.material or case.damping.air):
        yield "damping: none; vibrations do not decay"
    if not any(case.gravity):
        yield "gravity: not given"


def _approximations(case: Case) -> Iterator[str]:
    yield "thin film: no shear across the thickness; slopes across element edges are not continuous (ACM rectangle)"
    if case.air is not None:
        yield "air: the same added mass for all modes, which is valid for the lowest modes"
    if case.tension is not None and case.tension.film == "tension-field":
        yield "tension field: single wrinkles, and their bending stiffness, are not modelled"


def _from_deployed(case: Case) -> Iterator[str]:
    yield "the strip at the end of the travel: its shape and thickness, with creases as lines with springs"
    yield "the supports and drives of the strip are the supports of the film"


_Section = tuple[str, Callable[[Case], Iterator[str]]]
_MOTION: tuple[_Section, ...] = (
    ("air", _air),
    ("damping", _damping),
    ("impact", _impact),
    ("steps", _steps),
    ("computed", _computed),
    ("left out", _left_out),
    ("approximate", _approximations),
)
_SECTIONS: tuple[_Section, ...] = (
    ("case", _title),
    ("film", _film),
    ("mesh", _mesh),
    ("patches", _patches),
    ("cables", _cables),
    ("held", _support),
    ("tension", _tension),
    *_MOTION,
)
_DEPLOYED: tuple[_Section, ...] = (("film", _from_deployed), *_MOTION)
