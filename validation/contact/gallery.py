"""Parts of `python -m validation.contact` for the gallery."""

from __future__ import annotations

from collections.abc import Iterator

from validation.contact.__main__ import check_box, check_friction, check_peer, check_range, check_stack
from validation.gallery.margins import with_margins
from validation.gallery.record import Check, Part, Place

TITLE = "Contact in piles"


def stack(place: Place) -> Iterator[Check]:
    """A strip of many steep folds is pressed flat and released: eight panels, with --full twenty."""
    yield from with_margins(
        check_stack(not place.full, place.out), "bounds by statics, conservation of energy", place.out / "stack.png"
    )


def box(place: Place) -> Iterator[Check]:
    """Plates are dropped into a box: twelve, with --full two hundred."""
    yield from with_margins(
        check_box(not place.full, place.out), "bounds by energy, conservation of energy", place.out / "box.png"
    )


def friction(place: Place) -> Iterator[Check]:
    """The pulled strip in space and in the plane, and with friction."""
    yield from with_margins(
        check_friction(not place.full, place.out), "the plane; smoothness in the coefficient", place.out / "friction.png"
    )


def stiffness(place: Place) -> Iterator[Check]:
    """Stiffness and thickness of contact over decades."""
    yield from with_margins(
        check_range(not place.full, place.out), "a run time that hardly depends on them", place.out / "range.png"
    )


def bodies(place: Place) -> Iterator[Check]:
    """Plates that collide, hit the floor with one end, and slide, compared with closed forms of rigid impulses."""
    yield from with_margins(check_peer(not place.full, place.out), "closed forms of rigid bodies", place.out / "bodies.png")


PARTS: dict[str, Part] = {"stack": stack, "box": box, "friction": friction, "stiffness": stiffness, "bodies": bodies}
