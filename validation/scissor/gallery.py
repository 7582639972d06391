"""Parts of `python -m validation.scissor` for the gallery."""

from __future__ import annotations

from collections.abc import Iterator

from validation.gallery.margins import with_margins
from validation.gallery.record import Check, Part, Place
from validation.scissor.__main__ import check_alpha, check_elements, check_limit

TITLE = "Scissor arrays"


def alpha(place: Place) -> Iterator[Check]:
    """High frequencies decay faster with smaller rho_inf, and the displacement stays the same."""
    source = (
        "paper on scissor arrays in absolute nodal coordinates, section 5, figures 5 and 6: high "
        "frequencies are dissipated, the motion is preserved"
    )
    yield from with_margins(check_alpha(not place.full, place.out), source, place.out / "alpha.png")


def limit(place: Place) -> Iterator[Check]:
    """Differences from rigid bars are proportional to 1/E."""
    yield from with_margins(
        check_limit(not place.full, place.out),
        "Lagrange's equation of rigid bars, DOP853 at 1e-11",
        place.out / "rigid_limit.png",
    )


def elements(place: Place) -> Iterator[Check]:
    """Three kinds of elements with several numbers of elements per bar, compared with eight elements of one kind."""
    yield from with_margins(
        check_elements(False, place.out), "eight elements a bar; conservation of energy", place.out / "elements.png"
    )


PARTS: dict[str, Part] = {"alpha": alpha, "limit": limit, "elements": elements}
