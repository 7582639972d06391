"""Places on the mesh of flexible facets: edges, vertices, facets, and boxes around nodes."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from fsm.scene.patterns.facet_mesh import FacetMesh

__all__ = ["MeshPlace", "mesh_place"]

_NUMBERS = re.compile(r"(?:vertex|vertices)\s+(\d+(?:\s*,\s*\d+)*)")


class MeshPlace(NamedTuple):
    """Place on a mesh: its name, its nodes (sectors), and its edges (k, 2) as in `FacetMesh`; a place of single nodes has no
    edges.
    """

    name: str
    sectors: np.ndarray
    edges: np.ndarray


def mesh_place(mesh: FacetMesh, at: str | tuple[tuple[float, float, float], tuple[float, float, float]]) -> MeshPlace:
    """Nodes of a mesh at a place.

    Parameters
    ----------
    mesh : FacetMesh
    at : str, or two opposite corners of a box in m
        "edge left", "vertex 2", "vertices 1, 2", "facet 7" (numbers from 1), or a box around nodes at the start.

    Raises
    ------
    ValueError
        There is no such place; the message lists the places.
    """
    none = np.zeros((0, 2), dtype=np.int64)
    if not isinstance(at, str):
        found = mesh.in_box(np.array(at))
        if not len(found):
            low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
            sides = "; ".join(f"{x} {a:.4g} to {b:.4g} m" for x, a, b in zip("xyz", low, high, strict=True))
            raise ValueError(f"the box contains no node of the mesh, which extends over {sides}; move or enlarge the box")
        return MeshPlace("box " + " ".join(f"{x:.12g}" for x in np.array(at).ravel()), found, none)
    name = at.strip()
    word, _, rest = name.partition(" ")
    if word == "edge":
        if rest not in mesh.edges:
            names = ", ".join(f'"edge {known}"' for known in mesh.edges)
            raise ValueError(f'"{name}" is not an edge of the sheet; its edges are {names or "not named, give vertices"}')
        edges = mesh.edges[rest]
        return MeshPlace(name, np.unique(mesh.ends(edges)), edges)
    match = _NUMBERS.fullmatch(name)
    if word == "facet" and rest.strip().isdigit():
        facet, known = int(rest) - 1, int(mesh.facet.max()) + 1
        if not 0 <= facet < known:
            raise ValueError(f"there is no facet {facet + 1}; the sheet has {known} facets, numbered from 1")
        return MeshPlace(name, np.unique(mesh.triangles[mesh.facet == facet]), none)
    if match is None:
        text = 'give "edge left", "vertex 12", "vertices 3, 4, 5", "facet 7", or a box [[x, y, z], [x, y, z]]'
        raise ValueError(f'"{name}" is not a place of flexible facets; {text}')
    numbers = [int(number) - 1 for number in match[1].split(",")]
    for number in numbers:
        if not 0 <= number < len(mesh.vertices):
            known = len(mesh.vertices)
            raise ValueError(f"there is no vertex {number + 1}; the sheet has {known} vertices, numbered from 1")
    return MeshPlace(name, mesh.vertices[list(dict.fromkeys(numbers))], none)
