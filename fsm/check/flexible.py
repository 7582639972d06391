"""Lines of `fsm check` about the films, cables, beams and trusses of a scene."""

from __future__ import annotations

from collections.abc import Iterator

from fsm.case.derived.contact_points import penetration_between, point_spacing, points_along
from fsm.case.models.flexible import unstressed_length
from fsm.check.view import CheckContext
from fsm.text.shown_units import count, material_text, shown, shown_size


def film_lines(view: CheckContext) -> Iterator[str]:
    """Sizes, mesh and material of every film."""
    for film in view.scene.films:
        nx, ny = film.mesh
        held = f", held: {', '.join(film.held)}" if film.held else ", not held"
        yield (
            f"{film.name}: {shown_size(film.length, film.width, film.thickness)}, "
            f"{nx} x {ny} ANCF elements, {9 * (nx + 1) * (ny + 1)} coordinates{held}"
        )
        yield (
            f"{film.name}: {material_text(film.young, film.poisson, film.density)}, "
            f"strain at the start ({film.strain[0]:g}, {film.strain[1]:g})"
        )


def cable_lines(view: CheckContext) -> Iterator[str]:
    """Sizes, mesh and material of every cable."""
    for cable in view.scene.cables:
        held = f", held: {', '.join(cable.held)}" if cable.held else ""
        yield (
            f"{cable.name}: {shown(unstressed_length(cable), 'm')} without stress, diameter "
            f"{shown(cable.diameter, 'm')}, {count(cable.elements, 'ANCF element')}, E {shown(cable.young, 'Pa')}, "
            f"strain at the start {cable.strain:g}{held}"
        )


def beam_lines(view: CheckContext) -> Iterator[str]:
    """Sizes, mesh and material of every beam."""
    for beam in view.scene.beams:
        held = f", held: {', '.join(beam.held)}" if beam.held else ""
        yield (
            f"{beam.name}: {shown(unstressed_length(beam), 'm')} without stress, section "
            f"{shown_size(beam.width, beam.thickness)}, {count(beam.elements, 'ANCF element')}, "
            f"E {shown(beam.young, 'Pa')}, strain at the start {beam.strain:g}{held}"
        )


def truss_lines(view: CheckContext) -> Iterator[str]:
    """Sizes of every truss of a [scene]."""
    for truss in view.scene.trusses if view.case.sheet is None else ():
        springs = f", {count(len(truss.folds), 'rotational spring')}" if truss.folds else ""
        held = f", {count(len(truss.held), 'held point')}" if truss.held else ", not held"
        yield f"{truss.name}: {count(len(truss.points), 'point')}, {count(len(truss.bars), 'bar')}{springs}{held}"


def _touching_points(view: CheckContext, named: set[str]) -> Iterator[str]:
    """Distances of contact points, and depth of round obstacles between them."""
    round_ones = {o.name: o.radius for o in view.scene.obstacles if o.radius is not None}
    for part in (*view.scene.films, *view.scene.lines.values()):
        if part.name not in named:
            continue
        count = points_along(view.scene, part)
        spacing = shown(max(point_spacing(part, count)), "m")
        text = f"{part.name} touches at points up to {spacing} apart: corners pass between them"
        pairs = [(pair.first, pair.second) for pair in view.pairs]
        radii = [round_ones[name] for pair in pairs if part.name in pair for name in pair if name in round_ones]
        if radii:
            text += f", and round obstacles sink in by up to {shown(penetration_between(part, count, min(radii)), 'm')}"
        yield text


def approximations_of_films(view: CheckContext) -> Iterator[str]:
    """Approximations of films, cables and beams."""
    scene = view.scene
    named = {name for pair in scene.pairs for name in (pair.first, pair.second)} if scene.contact is not None else set()
    flexible = [part.name for part in (*scene.films, *scene.lines.values())]
    if any(name not in named for name in flexible):
        parts = [name for name in flexible if name not in named]
        some = ", ".join(parts[:3]) + (f" and {len(parts) - 3} more" if len(parts) > 3 else "")
        yield f"bodies pass through {some}: no contact pair"
    if any(name in named for name in flexible):
        yield from _touching_points(view, named)
    if view.scene.films:
        yield "films resist compression like thin plates; wrinkles shorter than an element are not resolved"
    if scene.beams:
        yield "beams bend in the x-z plane only, without shear strain; supports carry the forces along y"
    if view.scene.cables:
        yield "cables have no torsion: a moment about a cable acts on its frame and does not travel along it"
    if any(seam.stiffness is not None for seam in view.scene.seams):
        yield "seams are springs: their two sides separate by the force per length of the edge over seam.stiffness"
