"""Cost of the broad phase of contact against the number of pieces of surfaces, and of rigid plates."""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from fsm.interactions.search.box_tree import fit_tree, window_pieces
from fsm.interactions.search.chord import chord_boxes, chords_planar, chords_spatial
from fsm.interactions.surfaces.surface import pieces_of
from fsm.model.contact.shapes.shape_tables import as_rectangle
from fsm.model.contact.shapes.side_contacts import Side, SideContacts
from validation.benchmarks.precision import Row, say
from validation.benchmarks.segments import slope

__all__ = [
    "BROAD_PHASE",
    "BROAD_PHASE_COLUMNS",
    "BROAD_PHASE_COUNTS",
    "QUICK_BROAD_PHASE_COUNTS",
    "broad_phase_table",
    "measure_broad_phase",
]

BROAD_PHASE = "broad_phase.csv"
BROAD_PHASE_COLUMNS = ("scene", "number", "time_s", "found", "slope")
BROAD_PHASE_COUNTS = (100, 200, 500, 1000, 2000, 5000, 10000, 20000)
QUICK_BROAD_PHASE_COUNTS = (100, 500, 2000)
PANELS = 4
CALLED = 20000
"""Pieces in all scenes of one count: with small ones again and again, the processor would learn them by heart."""
Job = Callable[[], int]


def _pack(angles: np.ndarray, length: float, seed: int) -> np.ndarray:
    """Poses of equal segments that are joined at approximately these angles."""
    angles = angles + 1e-3 * np.random.default_rng(seed).normal(size=len(angles))
    axes = length * np.column_stack([np.cos(angles), -np.sin(angles)])
    ends = np.cumsum(axes, axis=0)
    return np.column_stack([ends - 0.5 * axes, angles])


def _windows(poses: np.ndarray, surfaces: list[np.ndarray], watched: Sequence[int], length: float, warm: bool) -> Job:
    """Renewal of the windows: the middles of the segments of each surface are probes on another surface."""
    parts = [pieces_of(bodies, np.full(len(bodies), 0.5 * length)) for bodies in surfaces]
    owners, stations = (np.ascontiguousarray(np.vstack(part)) for part in zip(*parts, strict=True))
    edges = np.cumsum([0] + [len(own) for own, _ in parts])
    first = np.concatenate([np.full(len(own), edges[other]) for own, other in zip(surfaces, watched, strict=True)])
    last = np.concatenate([np.full(len(own), edges[other + 1]) for own, other in zip(surfaces, watched, strict=True)])
    spatial = poses.shape[1] == 7
    points = np.ascontiguousarray(poses[np.concatenate(surfaces), : 3 if spatial else 2])
    reach = np.full(len(points), 0.05 * length * len(surfaces[0]) + 4 * length)
    nearest, window = np.full(len(points), -1), np.zeros((len(points), 2), dtype=np.int64)

    def renew() -> int:
        if not warm:
            nearest[:] = -1
        half = np.full(len(owners), 0.02)
        chords = chords_spatial(poses, owners, stations, half) if spatial else chords_planar(poses, owners, stations)
        tree = fit_tree(*chord_boxes(chords))
        window_pieces(points, first, last, chords, tree, reach, 2 * length, nearest, window)
        return int(np.sum(window[:, 1] - window[:, 0]))

    return renew


def folded(count: int, seed: int, spatial: bool = False, warm: bool = True, flat: float = 0.02) -> Job:
    """Panels of 60 mm, folded up and wavy by a tenth of a radian; the points of each panel are probes on the next panel or
    the previous one."""
    panel = np.arange(count) // (count // PANELS)
    along = 2 * np.pi * np.arange(count) / (count // PANELS)
    angles = np.where(panel % 2 == 0, flat, np.pi - flat) + 0.1 * np.cos(3 * along)
    length = 0.06 * PANELS / count
    poses = _pack(angles, length, seed)
    if spatial:
        whole = np.zeros((count, 7))
        whole[:, [0, 2]] = poses[:, :2]
        whole[:, 3], whole[:, 5] = np.cos(0.5 * poses[:, 2]), np.sin(0.5 * poses[:, 2])
        poses = whole
    surfaces = [np.flatnonzero(panel == number) for number in range(PANELS)]
    return _windows(poses, surfaces, [1, 0, 3, 2], length, warm)


def rolled(count: int, seed: int) -> Job:
    """A sheet of 60 mm, rolled up in ten coils; the sheet's points are probes on another sheet beside it."""
    turned = 20 * np.pi * np.sqrt(np.linspace(0.02, 1.0, count // 2))
    length = 0.12 / count
    one = _pack(turned, length, seed)
    other = one + np.array([0.0, 2e-4, 0.0])
    half = count // 2
    return _windows(np.vstack([one, other]), [np.arange(half), np.arange(half, 2 * half)], [1, 0], length, True)


def held(count: int, seed: int) -> Job:
    """A chain of 80 mm lies on a plate of 80 mm that is one piece, and another chain on a plate of 1 m; both sides have
    probes on each other."""
    length = 0.08 / count
    poses = np.vstack([_pack(np.zeros(count), length, seed) + [0.0, 1e-3, 0.0], [[0.04, 0.0, 0.3], [0.5, 0.0, 0.0]]])
    return _windows(poses, [np.arange(count), np.array([count, count + 1])], [1, 0], length, True)


def _pile(count: int, seed: int, thick: int) -> tuple[SideContacts, np.ndarray]:
    """Plates of 20 x 15 x 1 mm with random orientations, at `thick` heights, so close that each plate overlaps the boxes of
    several others."""
    rng = np.random.default_rng(seed)
    columns = int(np.ceil(np.sqrt(count / thick)))
    layer, place = np.divmod(np.arange(count), columns**2)
    poses = rng.normal(size=(count, 7))
    poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    poses[:, :3] = 0.012 * np.column_stack([place // columns, place % columns, layer]) + rng.uniform(size=(count, 3)) * 0.005
    plates = [as_rectangle(body, 0.02, 0.015, 1e-3) for body in range(count)]
    all_of_them = [Side(np.arange(count), np.ones(count))]
    return SideContacts(plates, np.array([[0, 0]]), True, 5e-3, sides=all_of_them), poses


def heap(count: int, seed: int, flat: bool = False) -> Job:
    """Contact of every plate of a pile with every other plate: renewal and search, at two states that are so far apart that
    both need a renewal."""
    contacts, here = _pile(count, seed, 1 if flat else round(count ** (1 / 3)))
    states = itertools.cycle([here, here + [3e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    return lambda: len(contacts.find(next(states), 0.0).slot)


def still_heap(count: int, seed: int) -> Job:
    """The same at two states so near each other that no renewal is needed: search, rates and gradients."""
    contacts, here = _pile(count, seed, round(count ** (1 / 3)))
    rates = np.zeros((count, 6))

    def touch() -> int:
        return len(contacts.measure(here, rates, 0.0).bodies)

    return touch


SCENES: dict[str, Callable[[int, int], Job]] = {
    "windows, folded panels": folded,
    "windows, folded panels, for the first time": lambda count, seed: folded(count, seed, warm=False),
    "windows, panels on each other": lambda count, seed: folded(count, seed, flat=0.0),
    "windows, folded panels in space": lambda count, seed: folded(count, seed, spatial=True),
    "windows, rolled up": rolled,
    "windows, a chain on large plates": held,
    "plates in a heap, broad and narrow phase": heap,
    "plates in one layer, broad and narrow phase": lambda count, seed: heap(count, seed, flat=True),
    "plates in a heap, narrow phase": still_heap,
}
"""Timed scenes by name."""


def measure_broad_phase(counts: Sequence[int], repeat: int) -> Iterator[list[Row]]:
    """All rows so far; the file is written after every scene."""
    rows: list[Row] = []
    for scene, make in SCENES.items():
        own: list[Row] = []
        for count in counts:
            jobs = [make(count, seed) for seed in range(max(1, CALLED // count))]
            found = sum(job() for job in jobs) / len(jobs)
            times = []
            for _ in range(max(5, repeat)):
                begun = time.process_time()
                for job in jobs:
                    job()
                times.append((time.process_time() - begun) / len(jobs))
            taken = statistics.median(times)
            own.append({"scene": scene, "number": str(count), "time_s": f"{taken:.4g}", "found": f"{found:.4g}"})
        fitted = slope([float(row["number"]) for row in own], [float(row["time_s"]) for row in own])
        rows += [row | {"slope": f"{fitted:.3f}"} for row in own]
        say(f"{scene}: {own[-1]['time_s']} s with {own[-1]['number']}, slope {fitted:.3f}")
        yield rows


def broad_phase_table(rows: Sequence[Row]) -> str:
    """Times in ms and slopes, in Markdown."""
    counts = sorted({int(row["number"]) for row in rows})
    lines = ["| broad phase | " + " | ".join(map(str, counts)) + " | slope |", "|---" * (len(counts) + 2) + "|"]
    for scene in dict.fromkeys(row["scene"] for row in rows):
        own = {int(row["number"]): row for row in rows if row["scene"] == scene}
        cells = [f"{1e3 * float(own[n]['time_s']):.3g}" if n in own else "-" for n in counts]
        lines.append(f"| {scene} | {' | '.join(cells)} | {next(iter(own.values()))['slope']} |")
    return "\n".join(lines)
