"""The slit annulus for other programs: mesh and loads of CalculiX, errors, and the table."""

from __future__ import annotations

import math

import numpy as np
import pytest

from validation.peers.shells import INNER, LIFT, OUTER, Found, calculix_input, table


def section(text: str, keyword: str) -> list[list[float]]:
    """Numbers of the lines after a keyword."""
    lines = text.split(keyword)[1].splitlines()[1:]
    rows = []
    for line in lines:
        if line.startswith("*"):
            break
        rows.append([float(part) for part in line.split(",")])
    return rows


@pytest.mark.parametrize(("element", "corners"), [("S8R", 4), ("S6", 3)])
def test_calculix_has_the_plate_and_the_load(element: str, corners: int) -> None:
    text, unknowns = calculix_input(element, 2, 12)
    nodes = {int(row[0]): np.array(row[1:]) for row in section(text, "*NODE,")}
    area = 0.0
    for row in section(text, "*ELEMENT"):
        x, y, _ = np.array([nodes[int(k)] for k in row[1 : 1 + corners]]).T
        area += 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))  # positive: all normals up
        for k in range(corners):  # nodes between the corners
            middle = nodes[int(row[1 + corners + k])]
            ends = [nodes[int(row[1 + k])], nodes[int(row[1 + (k + 1) % corners])]]
            assert np.linalg.norm(middle - 0.5 * (ends[0] + ends[1])) < 0.1 * np.linalg.norm(ends[1] - ends[0])
    polygon = 0.5 * 12 * math.sin(math.tau / 12) * (OUTER**2 - INNER**2)
    assert area == pytest.approx(polygon, rel=1e-9)
    loads = section(text, "*CLOAD")
    assert sum(row[2] for row in loads) == pytest.approx(LIFT * (OUTER - INNER))
    moment = sum(row[2] * nodes[int(row[0])][0] for row in loads)
    assert moment == pytest.approx(LIFT * (OUTER**2 - INNER**2) / 2)
    held = {int(row[0]) for row in section(text, "*BOUNDARY")}
    assert held.isdisjoint(int(row[0]) for row in loads)  # both edges of the slit have their own nodes
    assert unknowns == 6 * (len(nodes) - len(held))


def test_table_has_the_larger_error_and_the_time_to_a_tenth_of_a_percent() -> None:
    runs = [
        Found("fsm", (6, 40), 1000, 1.01, 2.0, 1.0),
        Found("fsm", (20, 120), 9000, 1.0, 1.9998, 10.0),
        Found("Kratos thin 3N", (6, 40), 1000, 1.0, 2.1, 3.0),
    ]
    lines = table(runs, (1.0, 2.0)).splitlines()
    assert lines[2] == "| fsm | 6 x 40 | 1000 | 1.0100 | 2.0000 | 1.00 | 1.0 |"
    assert lines[4].split(" | ")[5] == "5.00"
    assert lines[-2] == f"| fsm | 1.0 | {10**0.5:.1f} |"
    assert lines[-1] == "| Kratos thin 3N | not reached | not reached |"
