"""Scene of a lattice: rigid squares with ligaments between facing corners (docs/calibration.md, "Hinged lattices")."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import cast

from fsm.case.models.case import Case
from fsm.case.models.lattice import Edge, Lattice
from fsm.case.models.loads import Drive
from fsm.case.models.scene import Body, ForceElement, Plate, Scene


def block_name(column: int, row: int) -> str:
    """Name of a square; columns are numbered from 1 at the left, rows from 1 at the bottom."""
    return f"block {column}.{row}"


def edge_blocks(lattice: Lattice, edge: Edge) -> tuple[str, ...]:
    """Names of the squares along an edge."""
    columns, rows = range(1, lattice.columns + 1), range(1, lattice.rows + 1)
    if edge in ("bottom", "top"):
        row = 1 if edge == "bottom" else lattice.rows
        return tuple(block_name(column, row) for column in columns)
    column = 1 if edge == "left" else lattice.columns
    return tuple(block_name(column, row) for row in rows)


def build_lattice(case: Case) -> Scene:
    """Scene of the lattice of a case."""
    assert case.lattice is not None
    lattice = case.lattice
    held = {name for edge in lattice.held_edges for name in edge_blocks(lattice, edge)}
    return Scene(
        bodies=tuple(_bodies(lattice, held)),
        elements=tuple(_hinges(lattice)),
        loads=case.load,
        drives=tuple(_drive(lattice, drive) for drive in case.drive),
        gravity=case.gravity,
    )


def _drive(lattice: Lattice, drive: Drive) -> Drive:
    if drive.edge is None:
        return drive
    return drive.model_copy(update={"edge": None, "bodies": edge_blocks(lattice, cast(Edge, drive.edge))})


def _radius(lattice: Lattice) -> float:
    """Distance of a corner from the centre of its square, m."""
    return (lattice.spacing - lattice.hinge_length) / (2.0 * math.cos(lattice.angle))


def _turn(lattice: Lattice, column: int, row: int) -> float:
    """Angle of the right corner of a square above the x axis, rad."""
    return lattice.angle * (-1.0 if (column + row) % 2 == 0 else 1.0)


def _bodies(lattice: Lattice, held: set[str]) -> Iterator[Body]:
    """Bodies of the squares; their x axes are normal to an edge, 45 degrees above the right corner."""
    side = math.sqrt(2.0) * _radius(lattice)
    mass = lattice.density * side**2 * lattice.depth
    across = mass / 12.0 * (side**2 + lattice.depth**2)
    for row in range(1, lattice.rows + 1):
        for column in range(1, lattice.columns + 1):
            # a positive rotation about y moves the x axis towards -z
            half = -0.5 * (_turn(lattice, column, row) + math.pi / 4.0)
            name = block_name(column, row)
            yield Body(
                name=name,
                mass=mass,
                inertia=(across, mass * side**2 / 6.0, across),
                position=((column - 1) * lattice.spacing, 0.0, (row - 1) * lattice.spacing),
                orientation=(math.cos(half), 0.0, math.sin(half), 0.0),
                held=name in held,
                plate=Plate(length=side, width=lattice.depth, thickness=side),
            )


def _hinges(lattice: Lattice) -> Iterator[ForceElement]:
    """Hinges from every square to its neighbours on the right and above."""
    side = math.sqrt(2.0) * _radius(lattice)
    right, top = (side / 2, 0.0, -side / 2), (side / 2, 0.0, side / 2)
    left, bottom = (-side / 2, 0.0, side / 2), (-side / 2, 0.0, -side / 2)
    for row in range(1, lattice.rows + 1):
        for column in range(1, lattice.columns + 1):
            if column < lattice.columns:
                yield _hinge(lattice, (column, row), right, (column + 1, row), left)
            if row < lattice.rows:
                yield _hinge(lattice, (column, row), top, (column, row + 1), bottom)


def _hinge(
    lattice: Lattice,
    first: tuple[int, int],
    point_first: tuple[float, float, float],
    second: tuple[int, int],
    point_second: tuple[float, float, float],
) -> ForceElement:
    axial, shear, rotational = lattice.stiffness
    beta = lattice.damping
    return ForceElement(
        name=f"hinge {first[0]}.{first[1]} - {second[0]}.{second[1]}",
        inner=block_name(*second),
        outer=block_name(*first),
        point_inner=_clamped(lattice, second, point_second),
        point_outer=_clamped(lattice, first, point_first),
        translation=(axial, 0.0, shear),
        rotation=(0.0, rotational, 0.0),
        translation_damping=(beta * axial, 0.0, beta * shear),
        rotation_damping=(0.0, beta * rotational, 0.0),
        frame="chord",
        bends=lattice.hinge_young is not None,
        kind="crease",
    )


def _clamped(lattice: Lattice, square: tuple[int, int], corner: tuple[float, float, float]) -> tuple[float, float, float]:
    """Point where the hinge at a corner of a square begins: the corner, moved into the square along the hinge."""
    turn = _turn(lattice, *square)
    depth = lattice.clamp / math.hypot(corner[0], corner[2])
    along = math.cos(turn) * corner[0] + math.sin(turn) * corner[2], math.cos(turn) * corner[2] - math.sin(turn) * corner[0]
    return corner[0] - depth * along[0], 0.0, corner[2] - depth * along[1]
