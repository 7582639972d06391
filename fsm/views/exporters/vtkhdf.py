"""VTKHDF file for ParaView and VTK: an unstructured grid over time with constant cells.

The layout is version 2.0 of the VTKHDF format: it stores points and data of all records one after the other, and the cells
once. Channels of parts are data of cells or points; every channel is also field data of each step.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from fsm.results.solution import Solution
from fsm.views.exporters.registry import exporter
from fsm.views.plots.mesh import Mesh, mesh_of

_TYPES = {2: 3, 3: 5, 4: 9}
"""VTK's numbers of a line, a triangle and a quadrilateral, by the number of corners."""
_SPARE = re.compile(r"[/\x00-\x1f\x7f]+")


@exporter("vtkhdf", "ParaView and VTK: shape over time, channels as data of cells, points and steps")
def write_vtkhdf(solution: Solution, path: Path) -> None:
    """Write an unstructured grid over time; lengths are in m, data in SI, with the unit in each name."""
    mesh = mesh_of(solution)
    records, points = mesh.points.shape[:2]
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0], dtype="i8")
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        connectivity = np.concatenate([cell[:count] for cell, count in zip(mesh.cells, mesh.corners, strict=True)])
        root.attrs["title"] = str(solution.layout.case.get("title", ""))
        root.attrs["parts"] = list(mesh.labels)  # names for the numbers in the cell data `part`
        root["NumberOfPoints"] = np.array([points], dtype="i8")
        root["NumberOfCells"] = np.array([len(mesh.cells)], dtype="i8")
        root["NumberOfConnectivityIds"] = np.array([len(connectivity)], dtype="i8")
        root["Connectivity"] = connectivity.astype("i8")
        root["Offsets"] = np.concatenate([[0], np.cumsum(mesh.corners)]).astype("i8")
        root["Types"] = np.array([_TYPES[int(count)] for count in mesh.corners], dtype="u1")
        root.create_dataset("Points", data=mesh.points.reshape(-1, 3), compression="gzip", compression_opts=1)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = records
        steps["Values"] = mesh.time
        steps["NumberOfParts"] = np.ones(records, dtype="i8")
        steps["PartOffsets"] = np.zeros(records, dtype="i8")
        steps["PointOffsets"] = np.arange(records, dtype="i8") * points
        steps["CellOffsets"] = np.zeros((records, 1), dtype="i8")
        steps["ConnectivityIdOffsets"] = np.zeros((records, 1), dtype="i8")
        _write_data(root, steps, mesh)


def _write_data(root: Any, steps: Any, mesh: Mesh) -> None:
    """Data of points, cells and steps, with the offset of each record."""
    records = len(mesh.time)
    constant = np.zeros(records, dtype="i8")
    cells = root.create_group("CellData")
    offsets = steps.create_group("CellDataOffsets")
    for name, numbers in (("panel", mesh.panel), ("part", mesh.label)):
        cells[name], offsets[name] = numbers, constant
    for group, found, size in (
        (cells, mesh.cell_data, len(mesh.cells)),
        (root.create_group("PointData"), mesh.point_data, mesh.points.shape[1]),
    ):
        places = offsets if group is cells else steps.create_group("PointDataOffsets")
        for name, (unit, values) in found.items():
            key = _name(name, unit)
            flat = values.reshape(records * size, -1)
            data = flat[:, 0] if flat.shape[1] == 1 else flat
            group.create_dataset(key, data=data, compression="gzip", compression_opts=1)
            places[key] = np.arange(records, dtype="i8") * size
    fields, places = root.create_group("FieldData"), steps.create_group("FieldDataOffsets")
    sizes = steps.create_group("FieldDataSizes")
    for name, channel in mesh.channels.items():
        key = _name(name, channel.info.unit)
        if key in fields:
            continue
        values = np.asarray(channel.values, dtype=float).reshape(records, -1)
        fields[key] = values
        places[key] = np.arange(records, dtype="i8")
        sizes[key] = np.tile(np.array([values.shape[1], 1], dtype="i8"), (records, 1))


def _name(name: str, unit: str) -> str:
    """Name of an array with its unit, without the separator of groups of HDF5."""
    return _SPARE.sub("_", f"{name} ({unit})".replace("/", "_per_") if "/" in unit else f"{name} ({unit})")
