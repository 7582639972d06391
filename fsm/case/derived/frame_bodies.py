"""Frames of a scene as bodies without mass, and the faults of films, cables, beams, trusses and frames."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import get_args

import numpy as np

from fsm.case.derived.contact_points import contact_points, points_inside
from fsm.case.models.flexible import Edge, SceneBeam, SceneCable, SceneFilm, SceneFrame, SceneSeam, unstressed_length
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Body, ForceElement, Quaternion, Scene
from fsm.case.models.touching import SheetPoint
from fsm.case.schema.known_names import nearest_name
from fsm.errors import Fault


def norm_faults(path: str, quaternion: Quaternion) -> Iterator[Fault]:
    """Fault of a quaternion whose norm is not 1."""
    norm = math.hypot(*quaternion)
    if abs(norm - 1.0) > 1e-6:
        yield Fault(path, f"the quaternion has norm {norm:g}; the norm must be 1 within 1e-6")


def quaternion_matrix(quaternion: Iterable[float]) -> np.ndarray:
    """Rotation matrix (3, 3) of a unit quaternion, scalar part first."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_product(p: Quaternion, r: Quaternion) -> Quaternion:
    """Product of two quaternions; the scalar part is first."""
    return (
        p[0] * r[0] - p[1] * r[1] - p[2] * r[2] - p[3] * r[3],
        p[0] * r[1] + p[1] * r[0] + p[2] * r[3] - p[3] * r[2],
        p[0] * r[2] - p[1] * r[3] + p[2] * r[0] + p[3] * r[1],
        p[0] * r[3] + p[1] * r[2] - p[2] * r[1] + p[3] * r[0],
    )


def cable_axes(cable: SceneCable | SceneBeam, normal: tuple[float, float, float]) -> np.ndarray:
    """Axes of a frame on a cable at the start, as rows of (3, 3): along the cable, across it, and near the normal.

    On a beam the second axis is y.
    """
    along = np.subtract(cable.end, cable.start) / math.dist(cable.start, cable.end)
    if isinstance(cable, SceneBeam):
        across = np.array([0.0, 1.0, 0.0])
        return np.array([along, across, np.cross(along, across)])
    across = np.cross(normal, along)
    across /= np.linalg.norm(across)
    return np.array([along, across, np.cross(along, across)])


def with_frames(scene: Scene) -> Scene:
    """Scene in which the frames are massless held bodies at their initial positions.

    Each seam becomes frames with joints or springs. Each contact point, and each end or edge that a joint, a spring or a
    cord names, becomes a frame. The scene must pass `frame_faults` without a fault.
    """
    frames = [*scene.frames, *_named_places(scene)]
    elements, joints = list(scene.elements), list(scene.joints)
    for seam in scene.seams:
        if not any(frame.name.startswith(f"{seam.name} (") for frame in frames):
            for frame, joined in _seam_parts(seam, scene):
                frames.append(frame)
                if isinstance(joined, SceneJoint):
                    joints.append(joined)
                else:
                    elements.append(joined)
    present = {frame.name for frame in frames}
    touching = [point.frame for points in contact_points(scene).values() for point in points]
    frames += [frame for frame in touching if frame.name not in present]
    scene = scene.model_copy(update={"frames": tuple(frames), "elements": tuple(elements), "joints": tuple(joints)})
    known = {body.name for body in scene.bodies}
    inside = points_inside(scene)
    bodies = [_frame_body(frame, scene, inside) for frame in scene.frames if frame.name not in known]
    if not bodies:
        return scene
    of_frames = {frame.name for frame in scene.frames}
    all_bodies = (*scene.bodies, *bodies)
    turned = {GROUND: (1.0, 0.0, 0.0, 0.0)} | {body.name: body.orientation for body in all_bodies}
    assembled = tuple(
        as_assembled(element, turned) if {element.inner, element.outer} & of_frames else element
        for element in scene.elements
    )
    return scene.model_copy(update={"bodies": all_bodies, "elements": assembled})


def part_places(scene: Scene) -> dict[str, SceneFrame]:
    """Frames at all ends of cables and beams and at all edges of films, by the names that joints have for them."""
    found = {}
    for name, line in scene.lines.items():
        upright = abs(line.end[2] - line.start[2]) > 0.9 * math.dist(line.start, line.end)
        normal = (1.0, 0.0, 0.0) if upright else (0.0, 0.0, 1.0)
        for end, at in (("start", 0.0), ("end", unstressed_length(line))):
            found[f"{name}.{end}"] = SceneFrame(name=f"{name}.{end}", on=name, at=(at,), normal=normal)
    for film in scene.films:
        for edge in ("left", "right", "bottom", "top"):
            found[f"{film.name}.{edge}"] = SceneFrame(name=f"{film.name}.{edge}", on=film.name, edge=edge)
    return found


def _named_places(scene: Scene) -> list[SceneFrame]:
    """Frames at ends and edges of flexible parts that joints, springs and cords name."""
    known = {GROUND, *(body.name for body in scene.bodies), *(frame.name for frame in scene.frames)}
    sides = [name for of in (scene.joints, scene.springs, scene.cords) for one in of for name in (one.first, one.second)]
    sides += [pulley.body for cord in scene.cords for pulley in cord.over]
    places = part_places(scene) if any("." in name for name in sides) else {}
    return [places[name] for name in dict.fromkeys(sides) if name not in known and name in places]


def as_assembled(element: ForceElement, turned: dict[str, Quaternion]) -> ForceElement:
    """Force element at a frame; its joint axes agree at the start, so twists and swings are zero in the initial state."""
    said = element.model_fields_set & {"axes_inner", "initial_angle", "crease"}
    if said or not any(element.rotation) or element.inner not in turned or element.outer not in turned:
        return element
    w, x, y, z = turned[element.inner]
    axes = quaternion_product((w, -x, -y, -z), quaternion_product(turned[element.outer], element.axes_outer))
    return element.model_copy(update={"axes_inner": axes})


def frame_faults(scene: Scene) -> Iterator[Fault]:
    """All faults of the flexible parts and frames of a scene."""
    films = {film.name: film for film in scene.films}
    cables = scene.lines
    frames = {frame.name for frame in scene.frames}
    names = [name for body in scene.bodies if (name := body.name) not in frames or not _is_frame(body)]
    names += [film.name for film in scene.films] + [cable.name for cable in scene.cables]
    names += [beam.name for beam in scene.beams]
    trusses = {truss.name: truss for truss in scene.trusses}
    names += list(trusses)
    names += [frame.name for frame in scene.frames]
    for name, count in Counter(names).items():
        if count > 1 and name in {*films, *cables, *trusses, *frames}:
            yield Fault("scene", f"the name {name!r} is used {count} times; names must differ")
    for i, film in enumerate(scene.films):
        yield from norm_faults(f"scene.films.{i}.orientation", film.orientation)
    bodies = [GROUND, *(body.name for body in scene.bodies)]
    for i, seam in enumerate(scene.seams):
        if seam.film not in films:
            text = f"no film is called {seam.film!r}{nearest_name(seam.film, [*films])}"
            yield Fault(f"scene.seams.{i}.film", text)
        if seam.edge not in get_args(Edge):
            text = f'must be "left", "right", "bottom", "top" or "corners" on a film; it is {seam.edge!r}'
            yield Fault(f"scene.seams.{i}.edge", text)
        for name in seam.bodies:
            if name not in bodies:
                yield Fault(f"scene.seams.{i}.bodies", f"no body is called {name!r}{nearest_name(name, bodies)}")
        if not seam.bodies:
            yield Fault(f"scene.seams.{i}.bodies", "there are none; give at least one body")
    inside = points_inside(scene)
    for i, frame in enumerate(scene.frames):
        path = f"scene.frames.{i}"
        if frame.name in inside or frame.on_sheet is not None:
            continue
        if (frame.point is not None) != (frame.on in trusses):
            text = "`point` is the number of a point of a truss; a film, a cable or a beam has `at`"
            yield Fault(f"{path}.point", text)
        elif frame.on in trusses:
            count = len(trusses[frame.on].points)
            if frame.point is not None and frame.point >= count:
                text = f"there is no point {frame.point}; {frame.on!r} has the points 0 to {count - 1}"
                yield Fault(f"{path}.point", text)
        elif frame.on in films:
            yield from _film_faults(frame, films[frame.on], path)
        elif frame.on in cables:
            yield from _cable_faults(frame, cables[frame.on], path)
        else:
            known = [*films, *cables, *trusses]
            yield Fault(f"{path}.on", f"no film, cable, beam or truss is called {frame.on!r}{nearest_name(frame.on, known)}")


def _seam_points(seam: SceneSeam, film: SceneFilm) -> list[tuple[float, float, float]]:
    """Points (x, y) of a seam on its film, m, and the length of the edge that each represents, m.

    The edge of a film is a cubic between two nodes. Three Gauss points per element constrain this cubic; springs at the
    nodes alone would not constrain it. An ideal seam has its nodes, where it also constrains the direction of the edge.
    """
    (nx, ny), b, c = film.mesh, 0.5 * film.length, 0.5 * film.width
    if seam.edge == "corners":
        size = max(film.length / nx, film.width / ny)
        return [(x, y, size) for x in (-b, b) for y in (-c, c)]
    side, count = (film.width, ny) if seam.edge in ("left", "right") else (film.length, nx)
    gauss = zip((0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15)), (5 / 18, 8 / 18, 5 / 18), strict=True)
    if seam.stiffness is None:
        parts = [(k / count, 1 / count) for k in range(count + 1)]
    else:
        parts = [((k + place) / count, weight / count) for place, weight in gauss for k in range(count)]
    points = []
    for place, weight in sorted(parts):
        at, length = (place - 0.5) * side, weight * side
        x, y = {"left": (-b, at), "right": (b, at), "bottom": (at, -c), "top": (at, c)}[seam.edge]
        points.append((x, y, length))
    return points


def _seam_parts(seam: SceneSeam, scene: Scene) -> Iterator[tuple[SceneFrame, SceneJoint | ForceElement]]:
    """Frames of a seam with the joints or springs between them and the bodies."""
    film = next(film for film in scene.films if film.name == seam.film)
    bodies = {body.name: body for body in scene.bodies}
    way = quaternion_matrix(film.orientation)[:, 1 if seam.edge in ("left", "right") else 0]
    for k, (x, y, length) in enumerate(_seam_points(seam, film)):
        frame = SceneFrame(name=f"{seam.name} ({k + 1})", on=film.name, at=(x, y))
        place = np.array(_on_film(frame, film).position)
        yield frame, joined_to_body(seam, frame.name, place, length, None if seam.edge == "corners" else way, bodies)


def joined_to_body(
    seam: SceneSeam, frame: str, place: np.ndarray, length: float, way: np.ndarray | None, bodies: dict[str, Body]
) -> SceneJoint | ForceElement:
    """Joint or spring of a seam between a frame at a place (3,) and the nearest body of the seam.

    Parameters
    ----------
    length : length of the edge that the frame represents, m
    way : direction (3,) of the edge; None: the frame has no axes, or the seam is at corners
    bodies : bodies by name
    """
    known = bodies | {GROUND: _body(GROUND, np.zeros(3), (1.0, 0.0, 0.0, 0.0))}
    body = min((known[name] for name in seam.bodies), key=lambda body: math.dist(body.position, place.tolist()))
    x, y, z = place.tolist()
    if seam.stiffness is None:
        kind = "fixed" if seam.clamped else "spherical" if way is None else "revolute"
        axis = way.tolist() if way is not None and kind == "revolute" else None
        return SceneJoint(name=frame, kind=kind, first=body.name, second=frame, at=(x, y, z), axis=axis)
    x, y, z = (quaternion_matrix(body.orientation).T @ (place - np.array(body.position))).tolist()
    spring = seam.stiffness * length
    return ForceElement(
        name=frame, inner=frame, outer=body.name, point_outer=(x, y, z), translation=(spring, spring, spring)
    )


def _is_frame(body: Body) -> bool:
    return body.held and body.mass == 0.0 and not any(body.inertia)


def _film_faults(frame: SceneFrame, film: SceneFilm, path: str) -> Iterator[Fault]:
    if frame.edge is not None:
        if frame.at:
            yield Fault(f"{path}.at", "a frame on an `edge` has no `at`; remove one of them")
        return
    if len(frame.at) != 2:
        yield Fault(f"{path}.at", f"{len(frame.at)} numbers; give (x, y) from the centre of the film, in m")
        return
    for value, side, name in zip(frame.at, (film.length, film.width), "xy", strict=True):
        if abs(value) > 0.5 * side * (1.0 + 1e-9):
            text = f"{name} = {value:g} m lies outside the film; give {-0.5 * side:g} to {0.5 * side:g} m"
            yield Fault(f"{path}.at", text)


def _cable_faults(frame: SceneFrame, cable: SceneCable | SceneBeam, path: str) -> Iterator[Fault]:
    length, what = unstressed_length(cable), "beam" if isinstance(cable, SceneBeam) else "cable"
    if frame.edge is not None:
        yield Fault(f"{path}.edge", f"a {what} has no edges; give `at`, the distance from its start, in m")
    if len(frame.at) != 1:
        yield Fault(f"{path}.at", f"{len(frame.at)} numbers; give the distance from the start of the {what}, in m")
    elif not -1e-9 * length <= frame.at[0] <= (1.0 + 1e-9) * length:
        yield Fault(f"{path}.at", f"{frame.at[0]:g} m lies outside the {what}, which is {length:g} m long without stress")
    if what == "beam":
        return
    direction = np.subtract(cable.end, cable.start)
    if not np.linalg.norm(np.cross(direction, frame.normal)) > 1e-6 * np.linalg.norm(direction):
        yield Fault(f"{path}.normal", f"{frame.normal} is parallel to the cable; give a vector across it")


def _frame_body(frame: SceneFrame, scene: Scene, inside: dict[str, SheetPoint]) -> Body:
    """Massless body at the initial position of a frame."""
    film = next((film for film in scene.films if film.name == frame.on), None)
    if film is not None:
        return _on_film(frame, film)
    if frame.name in inside:
        assert scene.built.touching is not None
        point = inside[frame.name]
        place = np.array(point.weights) @ scene.built.touching.positions[list(point.nodes)]
        return _body(frame.name, place, (1.0, 0.0, 0.0, 0.0))
    truss = next((truss for truss in scene.trusses if truss.name == frame.on), None)
    if truss is not None and frame.point is not None:
        return _body(frame.name, np.array(truss.points[frame.point]), (1.0, 0.0, 0.0, 0.0))
    return _on_cable(frame, scene.lines[frame.on])


def _on_film(frame: SceneFrame, film: SceneFilm) -> Body:
    at = edge_middle(film, frame.edge) if frame.edge is not None else frame.at
    local = [at[0] * (1.0 + film.strain[0]), at[1] * (1.0 + film.strain[1]), 0.0]
    place = np.array(film.position) + quaternion_matrix(film.orientation) @ np.array(local)
    return _body(frame.name, place, film.orientation)


def edge_middle(film: SceneFilm, edge: str) -> tuple[float, float]:
    """Middle (x, y) of an edge of a film, m."""
    b, c = 0.5 * film.length, 0.5 * film.width
    return {"left": (-b, 0.0), "right": (b, 0.0), "bottom": (0.0, -c), "top": (0.0, c)}[edge]


def _on_cable(frame: SceneFrame, cable: SceneCable | SceneBeam) -> Body:
    axes = cable_axes(cable, frame.normal)
    place = np.array(cable.start) + axes[0] * frame.at[0] * (1.0 + cable.strain)
    return _body(frame.name, place, matrix_quaternion(axes.T))


def _body(name: str, place: np.ndarray, orientation: tuple[float, float, float, float]) -> Body:
    position = (float(place[0]), float(place[1]), float(place[2]))
    return Body(
        name=name, mass=0.0, inertia=(0.0, 0.0, 0.0), position=position, orientation=orientation, held=True
    )


def matrix_quaternion(matrix: np.ndarray) -> tuple[float, float, float, float]:
    """Unit quaternion of a rotation matrix: an eigenvector of the largest eigenvalue (Bar-Itzhack, 2000)."""
    m = matrix
    k = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    w, x, y, z = np.linalg.eigh(k)[1][:, -1].tolist()
    return (w, x, y, z) if w >= 0.0 else (-w, -x, -y, -z)
