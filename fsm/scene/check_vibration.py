"""What no section of a tensioned film can see alone."""

from __future__ import annotations

from collections.abc import Iterable

from fsm.errors import Fault
from fsm.scene.builders.membrane import check_film
from fsm.scene.materials import Material
from fsm.scene.membrane import CornerCable, Membrane
from fsm.scene.sections import Sections, keys_of_paths, method_faults

__all__ = ["check_vibration"]

_OPPOSITE = {"left": "right", "right": "left", "bottom": "top", "top": "bottom"}
_SIDES = frozenset(_OPPOSITE)


def check_vibration(sections: Sections) -> list[Fault]:
    """Contradictions between the sections of a film and its vibration."""
    faults = [*_vibration_solve(sections)]
    if sections.stages == ("vibrate",):
        faults += [*_missing_film(sections), *_slack(sections), *_held_points(sections), *_film_damping(sections)]
        if sections.membrane is not None:
            faults += check_film(sections.membrane, sections.patches)
    faults += _points(sections)
    return faults



def _missing_film(sections: Sections) -> Iterable[Fault]:
    for name, why in (
        ("membrane", "it says what film there is"),
        ("material", "a film needs it"),
        ("tension", "without it the film is slack and cannot vibrate; give `pull` at the corners or `strain` of the edges"),
    ):
        if name not in sections.written:
            yield Fault(name, f"section [{name}] is missing; {why}")


def _slack(sections: Sections) -> Iterable[Fault]:
    """Tension that leaves the film slack."""
    tension, material = sections.tension, sections.material
    if tension is None:
        return
    if tension.pull is not None and not tension.pull > 0.0:
        yield Fault("tension.pull", "the film is slack: a pull above 0 N is wanted")
    if tension.strain is not None:
        strain = tension.strain if isinstance(tension.strain, tuple) else (tension.strain, tension.strain)
        nu = material.poisson if material is not None else 0.3
        stress = max(strain[0] + nu * strain[1], strain[1] + nu * strain[0])
        if not stress > 0.0:
            yield Fault("tension.strain", f"the film is slack: {_list(strain)} stretches it nowhere; give more than 0")
        elif max(strain) > 0.2:
            yield Fault("tension.strain", f"{_list(strain)} is no small strain; it is a part, 1e-3 for 0.1 %")


def _list(values: Iterable[float]) -> str:
    return f"[{', '.join(f'{value:g}' for value in values)}]"


def _held_points(sections: Sections) -> Iterable[Fault]:
    """Supports that are not there, and tension that nothing holds afterwards."""
    cables = [cable for cable in sections.cables.values() if isinstance(cable, CornerCable)]
    if len(cables) > 1:
        yield Fault("cable", "more than one section of cables at the corners; give one")
    at = {support.at for support in sections.supports.values()}
    for number, support in sections.supports.items():
        if support.at == "cables" and not cables and "cable" not in sections.written:
            yield Fault(f"support.{number}.at", 'there are no cables at the corners; add [[cable]] with place = "corners"')
        if support.position is not None and sections.membrane is not None:
            yield from _on_film(sections.membrane, support.position, f"support.{number}.position")
    if sections.tension is None or not at:
        return
    if sections.tension.pull is not None and not at & {"corners", "cables", "edges"}:
        yield Fault("support", "nothing holds the corners that `tension.pull` draws at; add a support there, or give none")
    if sections.tension.strain is None:
        return
    sides = at & _SIDES
    if not sides and "edges" not in at:
        yield Fault("support", "nothing holds the edges that `tension.strain` moves; add a support there, or give none")
    elif len(sides) == 1 and len(at) == 1:
        (side,) = sides
        text = f'only the edge "{side}" is held, and the film is free to go slack where `tension.strain` moves the others'
        yield Fault("support", f'{text}; hold "{_OPPOSITE[side]}" too, or "edges"')


def _film_damping(sections: Sections) -> Iterable[Fault]:
    material = sections.material
    for key, hint in (("damping", "`damping.material`"), ("plate", "nothing: a film is a plate always")):
        if material is not None and getattr(material, key) != Material.model_fields[key].default:
            yield Fault(f"material.{key}", f"is of the joints of a strip; a film has {hint}; take it out")


def _points(sections: Sections) -> Iterable[Fault]:
    """Probes and impact beside the film."""
    film = sections.membrane
    if film is None:
        return
    if sections.impact is not None:
        yield from _on_film(film, sections.impact.point, "impact.point")
    if sections.vibration is not None:
        for name, point in sections.vibration.probes.items():
            yield from _on_film(film, point, f"vibration.probes.{name}")


def _on_film(film: Membrane, point: tuple[float, float], path: str) -> Iterable[Fault]:
    half = (0.5 * film.length, 0.5 * film.width)
    if any(abs(x) > limit * (1 + 1e-9) for x, limit in zip(point, half, strict=True)):
        yield Fault(
            path,
            f"({1e3 * point[0]:.4g}, {1e3 * point[1]:.4g}) mm is beside the film, which goes to "
            f"({1e3 * half[0]:.4g}, {1e3 * half[1]:.4g}) mm from its centre",
        )


def _vibration_solve(sections: Sections) -> Iterable[Fault]:
    """Keys of [solve] and [save] that are of drives."""
    solve, save = sections.solve, sections.save
    if sections.stages != ("vibrate",):
        return
    if solve is not None:
        if solve.method == "static":
            yield Fault("solve.method", 'a vibration is dynamic; give "generalized-alpha" or leave it "auto"')
        if solve.spatial:
            yield Fault("solve.spatial", "a film is in space always; take it out")
        of_drives = dict.fromkeys(keys_of_paths(solve), "it is of drives")
        ends = {} if solve.end_time is None else {"end_time": "`vibration.duration` says when it ends"}
        for key, hint in (ends | of_drives).items():
            yield Fault(f"solve.{key}", f'not used with analysis = "vibrate": {hint}; take it out')
        if solve.method != "auto":  # which is generalized-alpha here
            yield from method_faults(solve)
    if save is not None and save.every is not None:
        yield Fault("save.every", "counts the travel of a drive; give `interval` (time) instead")
