"""Mesh lines of a film: they meet the patch edges; films that cannot be meshed are refused."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from fsm.case.derived.membrane import COARSEST, check_film, mesh_lines, place_patches
from fsm.case.models.membrane import Membrane, Patch

FILM = Membrane(length=0.3, width=0.3, thickness=25e-6)
SHEET = {"thickness": 1e-3, "young": 2e11, "density": 7800}


def patch(**keys: Any) -> Patch:
    return TypeAdapter(Patch).validate_python(SHEET | {"size": 0.01} | keys)


def numbered(*patches: Patch) -> dict[int, Patch]:
    return dict(enumerate(patches))


def test_a_plain_film_is_even() -> None:
    lines = mesh_lines(FILM, [])
    assert np.allclose(lines.x, np.linspace(-0.15, 0.15, 13), rtol=0, atol=1e-15)
    assert lines.x == lines.y
    assert lines.x[0] == -0.15 and lines.x[-1] == 0.15


def test_lines_meet_the_edges() -> None:
    placed = place_patches(FILM, numbered(patch(place="diagonal", distance=0.08), patch(place="centre", size=0.02)))
    lines = mesh_lines(FILM, placed)
    for one in placed:
        for axis, along in enumerate((lines.x, lines.y)):
            for edge in one.edges(axis):
                assert min(abs(edge - line) for line in along) < 1e-12
    assert max(b - a for a, b in pairwise(lines.x)) <= 0.025 * (1 + 1e-6)
    assert all(b > a for a, b in pairwise(lines.x))


def test_elements_know_their_patch() -> None:
    placed = place_patches(FILM, numbered(patch(place="position", position=(-0.05, 0.03), size=0.03)))
    lines = mesh_lines(FILM, placed)
    area = 0.0
    for i, (x0, x1) in enumerate(pairwise(lines.x)):
        for j, (y0, y1) in enumerate(pairwise(lines.y)):
            if lines.patch_of(placed, i, j) == 0:
                area += (x1 - x0) * (y1 - y0)
    assert area == pytest.approx(0.03**2, rel=1e-12)


def test_places() -> None:
    half = 0.08 / np.sqrt(2)
    (one,) = place_patches(FILM, numbered(patch(place="diagonal", distance=0.08, arm="-+")))
    assert (one.x, one.y) == pytest.approx((-half, half))
    four = place_patches(FILM, numbered(patch(place="diagonals", distance=0.04, count=2)))
    assert len(four) == 8
    assert sum(p.x for p in four) == pytest.approx(0.0) and sum(p.y for p in four) == pytest.approx(0.0)
    assert max(np.hypot(p.x, p.y) for p in four) == pytest.approx(0.08)
    grid = place_patches(FILM, numbered(patch(place="grid", count=(3, 2), spacing=(0.05, 0.06))))
    assert sorted({round(p.x, 9) for p in grid}) == [-0.05, 0.0, 0.05]
    assert sorted({round(p.y, 9) for p in grid}) == [-0.03, 0.03]


def test_the_diagonal_of_a_rectangle_goes_to_its_corner() -> None:
    film = Membrane(length=0.4, width=0.3, thickness=25e-6)
    (one,) = place_patches(film, numbered(patch(place="diagonal", distance=0.1)))
    assert (one.x, one.y) == pytest.approx((0.08, 0.06))


def said(*patches: Patch, film: Membrane = FILM) -> str:
    return "\n".join(str(fault) for fault in check_film(film, numbered(*patches)))


def test_good_films_have_no_faults() -> None:
    assert said() == ""
    assert said(patch(place="diagonal", distance=0.08), patch(place="centre", size=0.02)) == ""
    # beside each other: they share an edge
    assert said(patch(place="centre", size=0.02), patch(place="position", position=(0.02, 0.0), size=0.02)) == ""
    # flush with the film's edge
    assert said(patch(place="position", position=(0.14, 0.0), size=0.02)) == ""


def test_a_patch_outside() -> None:
    text = said(patch(place="diagonal", distance=0.25))
    assert text.startswith("patch.0: extends 31.78 mm beyond the film along its length")
    assert "(176.8, 176.8) mm" in text and "move or shrink it" in text
    assert "patch.1: " in said(patch(place="centre"), patch(place="position", position=(0.0, 0.146)))


def test_patches_that_overlap() -> None:
    text = said(patch(place="centre", size=0.02), patch(place="position", position=(0.015, 0.0), size=0.02))
    assert text == (
        "patch.1: overlaps patch.0 by 5 mm (its centre is (15, 0) mm); place the centres at least 20 mm apart along x or y"
    )
    assert "another of the same section" in said(patch(place="grid", count=(2, 1), spacing=(0.005, 0.1)))


def test_a_mesh_too_coarse() -> None:
    text = said(patch(place="centre", size=0.002))
    assert text.startswith("membrane.mesh: too coarse for patch.0 along the length: an element at its edge is 2 mm wide")
    assert "at least 30 elements" in text
    fine = FILM.model_copy(update={"mesh": (30, 30)})
    assert said(patch(place="centre", size=0.002), film=fine) == ""
    widths = np.diff(mesh_lines(fine, place_patches(fine, numbered(patch(place="centre", size=0.002)))).x)
    assert (widths[1:] / widths[:-1]).max() <= COARSEST
    sliver = said(patch(place="position", position=(0.0, 0.1)), patch(place="position", position=(0.0005, -0.1)))
    assert "an element at its edge is 0.5 mm wide, its neighbour 24.17 mm" in sliver
