"""What a vibration is made of and what is left out of it, in plain words, without compiling it (`fsm check`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

from fsm.scene.builders.membrane import mesh_lines, place_patches
from fsm.scene.case import Case
from fsm.scene.membrane import CornerCable, Measured, Vibration

__all__ = ["MINAMI", "describe_film"]

_LABEL = 14
MINAMI = 0.68
"""Height of the air that moves along, over the length of the film; `fsm.ancf.air` says where it is from."""


def describe_film(case: Case) -> list[str]:
    """What is computed, what is left out and why, and the approximations that apply, a line each."""
    lines = []
    for label, section in _DEPLOYED if case.stages else _SECTIONS:
        for text in section(case):
            lines.append(f"{label:<{_LABEL}}{text}")
            label = ""
    return lines


def _mm(length: float) -> str:
    return f"{1e3 * length:.4g} mm"


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"


def _title(case: Case) -> Iterator[str]:
    if case.title:
        yield case.title


def _film(case: Case) -> Iterator[str]:
    film, material = case.membrane, case.material
    assert film is not None and material is not None
    yield f"{_mm(film.length)} x {_mm(film.width)} x {_mm(film.thickness)}, areal mass {_areal(case):.4g} kg/m^2"
    yield (
        f"E {1e-9 * material.young:.4g} GPa, Poisson's ratio {material.poisson:g}, {material.density:g} kg/m^3"
    )


def _areal(case: Case) -> float:
    assert case.membrane is not None and case.material is not None
    return case.material.density * case.membrane.thickness


def _mesh(case: Case) -> Iterator[str]:
    assert case.membrane is not None
    placed = place_patches(case.membrane, dict(enumerate(case.patch)))
    lines = mesh_lines(case.membrane, placed)
    columns, rows = len(lines.x) - 1, len(lines.y) - 1
    asked = case.membrane.mesh
    added = "" if (columns, rows) == asked else f" ({asked[0]} x {asked[1]} asked for; lines added at the patch edges)"
    sides = [b - a for along in (lines.x, lines.y) for a, b in pairwise(along)]
    yield f"{columns} x {rows} ANCF elements of {_mm(min(sides))} to {_mm(max(sides))}{added}"
    cables = sum(4 * cable.elements for cable in case.cable if isinstance(cable, CornerCable))
    cables += sum(2 * (columns + rows) for cable in case.cable if not isinstance(cable, CornerCable))
    nodes = (columns + 1) * (rows + 1)
    more = f", {_count(cables, 'cable element')}" if cables else ""
    yield f"{nodes} film nodes of 9 coordinates (position and two slopes){more}"


def _patches(case: Case) -> Iterator[str]:
    assert case.membrane is not None
    placed = place_patches(case.membrane, dict(enumerate(case.patch)))
    for number, patch in enumerate(case.patch):
        here = [one for one in placed if one.number == number]
        mass = patch.density * patch.thickness * patch.size**2
        where = ", ".join(f"({1e3 * one.x:.4g}, {1e3 * one.y:.4g})" for one in here[:4]) + (", ..." if len(here) > 4 else "")
        yield (
            f"{_count(len(here), 'patch', 'patches')} of {_mm(patch.size)} x {_mm(patch.size)} x {_mm(patch.thickness)}, "
            f"E {1e-9 * patch.young:.4g} GPa, {1e3 * mass:.4g} g each, at {where} mm"
        )


def _cables(case: Case) -> Iterator[str]:
    for cable in case.cable:
        kind = f"from each corner outwards, {_mm(cable.length)}" if isinstance(cable, CornerCable) else "along the edges"
        made = f"diameter {_mm(cable.diameter)}, E {1e-9 * cable.young:.4g} GPa, {cable.density:g} kg/m^3"
        yield f"{kind}, {made}; positions are shared with the film, slopes are not"


def _support(case: Case) -> Iterator[str]:
    if not case.support:
        tips = any(isinstance(cable, CornerCable) for cable in case.cable)
        pulled = case.tension is not None and case.tension.pull is not None
        yield ("outer ends of the cables" if tips else "corners" if pulled else "all edges") + ", as no [[support]] is given"
    for support in case.support:
        where = "" if support.position is None else f" ({1e3 * support.position[0]:g}, {1e3 * support.position[1]:g}) mm"
        yield f"{support.at}{where}, {', '.join(support.fixed)}" + (", slopes too" if support.clamped else "")


def _tension(case: Case) -> Iterator[str]:
    tension = case.tension
    assert tension is not None
    if tension.pull is not None:
        yield f"{tension.pull:g} N at every corner, outwards along its diagonal; then held there"
    else:
        strain = tension.strain if isinstance(tension.strain, tuple) else (tension.strain, tension.strain)
        yield f"edges drawn apart by the strains {strain[0]:g}, {strain[1]:g}; then held there"
    yield {
        "plain": "the film carries compression: where it would wrinkle, the case is refused",
        "tension-field": "tension field: no compression; wrinkled and slack parts carry what wrinkles do on average",
        "wrinkles": "wrinkles are resolved by the mesh, from waves in the film at the start",
    }[tension.film]


def _air(case: Case) -> Iterator[str]:
    if case.air is None or case.membrane is None:
        return
    mass = MINAMI * case.air.density * (case.air.length or case.membrane.length)
    ratio = mass / _areal(case)
    yield (
        f"{mass:.4g} kg/m^2 on the normal motion, {ratio:.3g} times the film's own (Minami): bare film vibrates "
        f"{(1.0 + ratio) ** -0.5:.3g} times as fast as in vacuum"
    )


def _damping(case: Case) -> Iterator[str]:
    if case.damping is None:
        return
    if case.damping.material:
        yield f"Kelvin-Voigt, {case.damping.material:g} s, in film, patches and cables"
    if case.damping.air:
        yield f"{case.damping.air:g} 1/s of the moving mass: amplitudes fall as exp(-{0.5 * case.damping.air:g} t)"


def _impact(case: Case) -> Iterator[str]:
    impact = case.impact
    if impact is None:
        return
    at = f"at ({1e3 * impact.point[0]:g}, {1e3 * impact.point[1]:g}) mm, normal to the film"
    if isinstance(impact, Measured):
        yield f"measured pulse, {len(impact.time)} points until {impact.time[-1]:g} s, {at}"
    else:
        yield f"{impact.pulse} of {impact.force:g} N for {1e3 * impact.duration:g} ms {at}"


def _computed(case: Case) -> Iterator[str]:
    vibration = case.vibration or Vibration()
    yield f"the tensioned state, and {_count(vibration.modes, 'natural mode')} about it"
    if case.impact is not None:
        yield f"{vibration.duration:g} s after the impact; spectral lines {1.0 / vibration.duration:.3g} Hz apart or more"
        names = {"center": None, **({"patch": None} if case.patch else {}), **vibration.probes}
        yield f"probes: {', '.join(names)}"


def _left_out(case: Case) -> Iterator[str]:
    if case.impact is None:
        yield "impact: no [impact]; nothing moves, and no frequency is measured"
    if case.air is None:
        yield "air: no [air]; as in vacuum"
    if case.damping is None or not (case.damping.material or case.damping.air):
        yield "damping: none; vibrations do not die away"
    if not any(case.gravity):
        yield "gravity: none given"


def _approximations(case: Case) -> Iterator[str]:
    yield "thin film: no shear across the thickness; slopes across element edges are not continuous (ACM rectangle)"
    if case.air is not None:
        yield "air: an added mass, the same for all modes; true for the lowest ones"
    if case.tension is not None and case.tension.film == "tension-field":
        yield "wrinkles themselves are not seen, nor that they stiffen the film across them"


def _from_deployed(case: Case) -> Iterator[str]:
    yield "the strip as it is at the end of the travel: its shape, its thickness, creases as lines with a spring"
    yield "what held and drew the strip holds the film"


_Section = tuple[str, Callable[[Case], Iterator[str]]]
_MOTION: tuple[_Section, ...] = (
    ("air", _air),
    ("damping", _damping),
    ("impact", _impact),
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
