"""Binary glTF 2.0 file: one mesh with a morph target for each frame, and an animation of their weights."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.views.exporters.registry import exporter
from fsm.views.plots.mesh import Mesh, mesh_of, playback

_FRAMES = 100
"""Largest number of frames; the file grows with points times frames."""
_BYTES = 64_000_000
"""Largest size of all frames; larger meshes have fewer frames."""
_PARTS = 50
"""Largest number of parts with separate materials."""
_FLOAT, _UINT = 5126, 5125
_ARRAY, _INDEX = 34962, 34963
_COLOURS = ("0072B2", "D55E00", "009E73", "CC79A7", "E69F00", "56B4E9", "F0E442")
_TURN = [-0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
"""Rotation from z upwards to y upwards, the convention of glTF; quaternion with the scalar part last."""


class _Buffer:
    """Binary chunk with its views and accessors."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.size = 0
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, kind: str, target: int | None = None, bounds: bool = False) -> int:
        """Append an array of float32 or uint32; return the number of its accessor."""
        data = np.ascontiguousarray(values).tobytes()
        view = {"buffer": 0, "byteOffset": self.size, "byteLength": len(data)}
        self.views.append(view if target is None else {**view, "target": target})
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1, "type": kind, "componentType": _FLOAT if values.dtype == "<f4" else _UINT,
            "count": len(values) if kind != "SCALAR" else values.size,
        }  # fmt: skip
        if bounds:
            flat = values.reshape(accessor["count"], -1)
            accessor |= {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        self.accessors.append(accessor)
        self.parts.append(data)
        self.size += len(data)
        return len(self.accessors) - 1


@exporter("glb", "3-D viewers, slides and web pages: animated mesh (glTF 2.0), colours by part")
def write_glb(solution: Solution, path: Path) -> None:
    """Write an animated mesh in m, with y upwards. A motion of less than 2 s or more than 20 s is shown in 8 s.

    The factor of the time and the number of frames are in `asset.extras`.
    """
    mesh = mesh_of(solution)
    frames = _frames(mesh)
    scale = playback(mesh.time)
    buffer = _Buffer()
    start = mesh.points[frames[0]].astype("<f4")
    shared = {"POSITION": buffer.add(start, "VEC3", _ARRAY, bounds=True)}
    targets = []
    for frame in frames[1:]:
        change = (mesh.points[frame] - mesh.points[frames[0]]).astype("<f4")
        targets.append({"POSITION": buffer.add(change, "VEC3", _ARRAY, bounds=True)})
    primitives = []
    single = len(mesh.labels) <= _PARTS
    group = mesh.label if single else mesh.label % len(_COLOURS)
    names = mesh.labels if single else [f"parts of colour {k + 1}" for k in range(len(_COLOURS))]
    for number in range(len(names)):
        chosen = group == number
        for mode, indices in ((4, _triangles(mesh, chosen)), (1, _lines(mesh, chosen))):
            if len(indices):
                each: dict[str, Any] = {
                    "attributes": shared, "indices": buffer.add(indices.astype("<u4"), "SCALAR", _INDEX), "mode": mode,
                    "material": number,
                }  # fmt: skip
                primitives.append({**each, "targets": targets} if targets else each)
    title = str(solution.layout.case.get("title", "")) or "fsm"
    document: dict[str, Any] = {
        "asset": {
            "version": "2.0", "generator": "fsm",
            "extras": {"unit": "m", "time_factor": scale, "frames": len(frames), "records": len(mesh.time)},
        },
        "scene": 0,
        "scenes": [{"nodes": [0], "name": title}],
        "nodes": [{"name": title, "rotation": _TURN, "children": [1]}, {"name": "structure", "mesh": 0}],
        "meshes": [{"name": title, "primitives": primitives}],
        "materials": [_material(name, k) for k, name in enumerate(names)],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    }  # fmt: skip
    if targets:
        document["meshes"][0]["weights"] = [0.0] * len(targets)
        document["animations"] = [_animation(buffer, mesh.time[frames], scale)]
    document["buffers"] = [{"byteLength": buffer.size}]
    _write(path, document, b"".join(buffer.parts))


def _frames(mesh: Mesh) -> np.ndarray:
    """Records that are frames: equally spaced in time, with the first and the last."""
    most = int(np.clip(_BYTES // (12 * mesh.points.shape[1]), 2, _FRAMES))
    times = np.linspace(mesh.time[0], mesh.time[-1], most)
    nearest = np.abs(mesh.time[None, :] - times[:, None]).argmin(axis=1)
    chosen = np.unique(np.concatenate([[0], nearest, [len(mesh.time) - 1]]))
    moved = np.concatenate([[True], np.diff(mesh.time[chosen]) > 0.0])  # such records belong to steps without a duration
    return np.asarray(chosen[moved])


def _animation(buffer: _Buffer, times: Floats, scale: float) -> dict[str, Any]:
    """Weights of the targets: each frame has the weight 1 at its time, and the motion between frames is linear."""
    weights = np.eye(len(times), dtype="<f4")[:, 1:]
    name = "motion" if scale == 1.0 else f"motion, {1.0 / scale:.4g} s in one second"
    return {
        "name": name,
        "samplers": [
            {
                "input": buffer.add(((times - times[0]) * scale).astype("<f4"), "SCALAR", bounds=True),
                "output": buffer.add(np.ascontiguousarray(weights), "SCALAR"),
                "interpolation": "LINEAR",
            }
        ],
        "channels": [{"sampler": 0, "target": {"node": 1, "path": "weights"}}],
    }


def _triangles(mesh: Mesh, chosen: np.ndarray) -> np.ndarray:
    """Triangles of chosen cells as one flat array."""
    quads = mesh.cells[chosen & (mesh.corners == 4)]
    triangles = mesh.cells[chosen & (mesh.corners == 3), :3]
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], triangles]).ravel()


def _lines(mesh: Mesh, chosen: np.ndarray) -> np.ndarray:
    return np.asarray(mesh.cells[chosen & (mesh.corners == 2), :2].ravel())


def _material(name: str, number: int) -> dict[str, Any]:
    code = _COLOURS[number % len(_COLOURS)]
    srgb = np.array([int(code[k : k + 2], 16) / 255.0 for k in (0, 2, 4)])
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    colour = [*np.round(linear, 5).tolist(), 1.0]
    return {
        "name": name, "doubleSided": True,
        "pbrMetallicRoughness": {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.8},
    }  # fmt: skip


def _write(path: Path, document: dict[str, Any], data: bytes) -> None:
    """Write the header and both chunks, each a multiple of four bytes long."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    with path.open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", len(data), b"BIN\0") + data)
