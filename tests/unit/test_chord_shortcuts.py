"""Bounds from chords for points far from the surface, compared with distances from the surface itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fsm.case.loading.load_case import load_case
from fsm.interactions.search.chord import chords_planar, largest_bulge
from fsm.interactions.surfaces.closest_planar import probe_points_planar
from fsm.interactions.surfaces.surface import blend
from fsm.model.compile.compile_case import compile_case
from fsm.model.contact.surfaces.array_surfaces import probe_heights_planar, probe_heights_spatial
from fsm.model.contact.surfaces.surface_contacts import SurfaceContacts
from fsm.model.system.system import SegmentSystem

CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"
SHARES = np.linspace(0.0, 1.0, 201)


def bent_strip(spatial: bool, seed: int) -> tuple[SegmentSystem, SurfaceContacts, np.ndarray]:
    """Every panel is bent to different arcs, so far that panels touch and pass through others."""
    changes = ["expect=none", "strip.segments_per_panel=6", f"solve.spatial={str(spatial).lower()}"]
    changes.append("strip.fold_angle=\"88 deg\"")
    system = compile_case(load_case(CASE, changes).case)[1]
    rng = np.random.default_rng(seed)
    size, height = system.size, 2 if spatial else 1
    move = np.zeros((system.n_free, size))
    for row, body in enumerate(system.bodies.free):
        panel, _, segment = system.bodies.names[body].split()[1:4]
        phase = np.pi * (int(segment) - 0.5) / 6
        bend = np.random.default_rng(10 * seed + int(panel)).uniform(-4e-3, 4e-3)
        move[row, 0] = bend * np.sin(phase)
        move[row, height] = 0.2 * bend * np.sin(phase)
        move[row, 4 if spatial else 2] = -bend * np.pi / 0.08 * np.cos(phase)
    q = system.retract(system.initial()[0], move.ravel())
    if spatial:
        turns = np.zeros((system.n_free, 6))
        turns[:, 3:] = 5e-3 * rng.standard_normal((system.n_free, 3))
        q = system.retract(q, turns.ravel())
    geometry = system.contacts[0].geometry
    assert isinstance(geometry, SurfaceContacts)
    return system, geometry, system.place(0.0, q, None)[0]


def drawn_heights(geometry: SurfaceContacts, poses: np.ndarray) -> np.ndarray:
    """Heights over the curves in the plane; there is no height where the nearest point drawn is an end."""
    probes, surfaces = geometry.probes, geometry.surfaces
    weights, points, tangents = np.empty((3, 4)), [], []
    for (a, b), stations in zip(surfaces.owners, surfaces.stations, strict=True):
        axes = [np.array([np.cos(poses[k, 2]), -np.sin(poses[k, 2])]) for k in (a, b)]
        rows = []
        for s in SHARES:
            blend(s, stations, weights)
            rows.append([w[0] * poses[a, :2] + w[2] * poses[b, :2] + w[1] * axes[0] + w[3] * axes[1] for w in weights[:2]])
        points.append(np.array(rows)[:, 0])
        tangents.append(np.array(rows)[:, 1])
    height = np.full(len(probes.body), np.nan)
    for i, at in enumerate(probe_points_planar(poses, probes.body, probes.place)):
        line = np.concatenate(points[probes.first_piece[i] : probes.last_piece[i]])
        along = np.concatenate(tangents[probes.first_piece[i] : probes.last_piece[i]])
        nearest = int(np.argmin(((line - at) ** 2).sum(axis=1)))
        if 0 < nearest < len(line) - 1:
            tangent = along[nearest] / np.linalg.norm(along[nearest])
            height[i] = tangent[0] * (at[1] - line[nearest, 1]) - tangent[1] * (at[0] - line[nearest, 0])
    return height


@pytest.mark.parametrize("seed", range(4))
def test_heights_and_contacts_in_the_plane(seed: int) -> None:
    _, geometry, poses = bent_strip(False, seed)
    probes, surfaces = geometry.probes, geometry.surfaces
    drawn = drawn_heights(geometry, poses)
    bulge = largest_bulge(chords_planar(poses, surfaces.owners, surfaces.stations), surfaces.stations)
    assert 1e-5 < bulge < 2e-3
    for farther in (0.0, 1e-3):
        geometry.refresh(poses)
        height = probe_heights_planar(geometry.table, poses, farther)
        known = np.isfinite(height) & np.isfinite(drawn)
        assert known.sum() > 50
        np.testing.assert_allclose(height[known], drawn[known], atol=bulge + 1e-6)
        clear = known & (np.abs(drawn) > 1e-6)
        np.testing.assert_array_equal(np.sign(height[clear]), np.sign(drawn[clear]))
        limit = probes.depth_limit[known]
        deep = np.abs(np.abs(drawn[known]) - limit) > 1e-6
        np.testing.assert_array_equal((np.abs(height[known]) > limit)[deep], (np.abs(drawn[known]) > limit)[deep])
    found = geometry.find(poses, 0.0)
    touching = np.zeros(len(drawn), dtype=bool)
    touching[found.slot] = True
    assert touching.sum() > 10
    side = np.where(geometry.side == 0.0, np.sign(drawn), geometry.side)
    gap = side * drawn - probes.clearance
    # well inside a surface, whose ends have tips and tapers, and not at the limit of contact
    sure = np.isfinite(drawn) & (np.abs(gap) > 1e-6) & (np.abs(gap + probes.depth_limit) > 1e-6) & (probes.straight == 0.0)
    wanted = (gap < 0.0) & (gap > -probes.depth_limit)
    np.testing.assert_array_equal(touching[sure], wanted[sure])


@pytest.mark.parametrize("seed", range(3))
def test_space_sees_what_the_plane_sees(seed: int) -> None:
    """Two lines of points across the width, and rotations of a few milliradians, change heights by amounts of their own size
    only."""
    _, flat, in_plane = bent_strip(False, seed)
    _, geometry, poses = bent_strip(True, seed)
    flat.refresh(in_plane)
    geometry.refresh(poses)
    plane = probe_heights_planar(flat.table, in_plane, 0.0)
    space = probe_heights_spatial(geometry.table, poses, 0.0).reshape(-1, 2)
    assert len(plane) == len(space)
    known = np.isfinite(plane) & np.isfinite(space).all(axis=1)
    assert known.sum() > 50
    np.testing.assert_allclose(space[known], np.stack([plane, plane], axis=1)[known], atol=1.2e-3)
    clear = known & (np.abs(plane) > 1.2e-3)
    np.testing.assert_array_equal(np.sign(space[clear, 0]), np.sign(plane[clear]))
