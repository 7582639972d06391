"""Places on the mesh of flexible facets: edges, vertices, facets, and boxes around nodes."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from fsm.case.models.facet_mesh import FacetMesh
from fsm.errors import CaseError, Fault

_PLANE = 1e-6
"""Distance of nodes from a plane of symmetry, relative to the size of the sheet, up to which they lie in it."""
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


def mirrored_place(mesh: FacetMesh, place: MeshPlace, axis: str, path: str) -> MeshPlace:
    """Edges of the outline at a place, which lie in a plane of symmetry normal to an axis, with all their nodes.

    A box selects the edges between its nodes, and a list of vertices those on the lines between the vertices.

    Raises
    ------
    CaseError
        The place has nodes beside such edges, or they do not lie in one plane.
    """
    edges = place.edges
    if not len(edges) and not place.name.startswith("facet"):
        edges = _outline_between(mesh, place)
    sectors = np.unique(mesh.ends(edges))
    if not len(edges) or not np.isin(mesh.owner[place.sectors], mesh.owner[sectors]).all():
        text = 'is not a part of the outline; give for example "edge left", both ends of a line of the outline, or a box'
        raise CaseError(Fault(f"{path}.mirror", f"{place.name} {text} around it"))
    at = mesh.positions[sectors, "xyz".index(axis)]
    if np.ptp(at) > _PLANE * np.ptp(mesh.positions, axis=0).max():
        text = f"{place.name} extends from {at.min():.6g} to {at.max():.6g} m along {axis}"
        raise CaseError(Fault(f"{path}.mirror", f"{text}, so it is in no plane normal to {axis}; correct the place or axis"))
    return MeshPlace(place.name, sectors, edges)


def _outline_between(mesh: FacetMesh, place: MeshPlace) -> np.ndarray:
    """Edges (k, 2) of one triangle between the nodes of a box, or on the lines between listed vertices."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    every = np.stack(np.divmod(np.arange(3 * len(mesh.triangles)), 3), axis=1)
    pairs = np.sort(mesh.owner[mesh.ends(every)], axis=1)
    _, first, count = np.unique(pairs, axis=0, return_index=True, return_counts=True)
    rows = np.sort(first[count == 1])
    outline, pairs = every[rows], pairs[rows]
    own = mesh.owner[place.sectors]
    if not place.name.startswith("vert"):
        return np.asarray(outline[np.isin(pairs, own).all(axis=1)])
    # lines: edges that meet at nodes between the vertices of the pattern
    vertex = np.isin(pairs, mesh.owner[mesh.vertices])
    line, end = np.nonzero(~vertex)
    joints = np.unique(pairs[line, end], return_inverse=True)[1]
    size = len(pairs) + (int(joints.max()) + 1 if len(joints) else 0)
    graph = coo_matrix((np.ones(len(line)), (line, len(pairs) + joints)), shape=(size, size))
    label = connected_components(graph, directed=False)[1][: len(pairs)]
    others = label[(vertex & ~np.isin(pairs, own)).any(axis=1)]
    return np.asarray(outline[~np.isin(label, others) & np.isin(label, label[vertex.any(axis=1)])])
