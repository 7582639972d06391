"""Picture of a mechanism at the start: bodies, joints with their axes, and positive turns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from fsm.builders.scene import build_scene
from fsm.case.derived.frame_bodies import quaternion_matrix
from fsm.case.derived.joint_frames import LINK, joint_axes, mechanism_lines, mechanism_size
from fsm.case.models.case import Case
from fsm.case.models.joint import SceneJoint
from fsm.case.models.scene import GROUND, Scene
from fsm.errors import CaseError
from fsm.text.shown_units import shown_unit
from fsm.views.plots.drawing import FORMATS, line_width
from fsm.views.plots.space import arrange_in_space, draw_axes, height_in_space
from fsm.views.plots.style import COLOURS, GREY, WIDE, add_legend_across, figure, shortened

_NAMED, _COLOURED = 24, 6
"""Largest number of joints with their names, and of bodies with a colour of their own."""
_ARROW, _RADIUS, _HEAD = 0.15, 0.05, 0.3
"""Length of an axis and radius of a positive turn, relative to the mechanism, and of its head relative to the radius."""
_TURNING = ("revolute", "cylindrical", "planar", "universal")
_AXIS = "#222222"


def draw_mechanism(case: Case, path: Path) -> None:
    """Draw the bodies and joints of a case at the start.

    Bodies without a plate are lines from their centres of mass to their joints. Arrows are axes of joints, arcs with a head
    are positive turns of the second body, and squares are joints to the ground.

    Raises
    ------
    CaseError
        The path does not name a picture, or the case has no ideal joints.
    """
    if path.suffix.lower() not in FORMATS:
        names = ", ".join(suffix.removeprefix(".").upper() for suffix in FORMATS)
        raise CaseError(f"{path}: the picture of a mechanism has the formats {names}; give --out FILE.png")
    scene = build_scene(case)
    if not scene.joints:
        raise CaseError("the picture shows ideal joints, and the case has none; see fsm preview for other cases", "--out")
    size = mechanism_size(scene)
    unit = shown_unit("m", size)
    with figure(path, WIDE) as fig:
        fig.set_layout_engine(None)
        ax: Any = fig.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d")
        ax.patch.set_visible(False)
        colours = _colours(scene)
        points = _draw_bodies(ax, scene, unit.factor, colours)
        for joint in scene.joints:
            points += _draw_joint(ax, joint, size, unit.factor)
        _name_joints(ax, scene, unit.factor)
        extent = np.array(points)
        low, high = extent.min(axis=0), extent.max(axis=0)
        sides = np.maximum(high - low, 0.25 * float((high - low).max()))
        extent = np.array([low + high - sides, low + high + sides]) / 2
        draw_axes(ax, unit.factor * sides, unit.factor * (low + high) / 2, unit.name)
        height = height_in_space(1, extent, 0.0)
        fig.set_figheight(height)
        named = [(name, colour) for name, colour in colours.items() if colour != GREY]
        handles = [Line2D([], [], color=colour, lw=line_width(2.5), label=shortened(name)) for name, colour in named]
        if len(named) < len(colours):
            handles.append(Line2D([], [], color=GREY, lw=line_width(2.5), label="bodies"))
        handles.append(Line2D([], [], color=_AXIS, marker=">", label="axis and positive turn"))
        if any(GROUND in (joint.first, joint.second) for joint in scene.joints):
            handles.append(Line2D([], [], color=_AXIS, marker="s", ls="", label="joint to the ground"))
        add_legend_across(fig, handles, "lower", columns=5)
        arrange_in_space(fig, 1, 1, fig.get_figheight() - height, 0.0)


def _colours(scene: Scene) -> dict[str, str]:
    """Colour of every body."""
    names = [body.name for body in scene.bodies]
    return {name: COLOURS[k] if len(names) <= _COLOURED else GREY for k, name in enumerate(names)}


def _draw_bodies(ax: Any, scene: Scene, factor: float, colours: dict[str, str]) -> list[np.ndarray]:
    """Draw plates and lines of all bodies; return their points, m."""
    points: list[np.ndarray] = [np.array(body.position) for body in scene.bodies]
    for body in scene.bodies:
        if body.plate is None:
            continue
        x, y = 0.5 * body.plate.length, 0.5 * body.plate.width
        corners = np.array(body.plate.outline or ((-x, -y), (x, -y), (x, y), (-x, y)))
        face = np.array(body.position) + np.pad(corners, ((0, 0), (0, 1))) @ quaternion_matrix(body.orientation).T
        style = {"facecolors": colours[body.name], "edgecolors": _AXIS, "linewidths": line_width(0.5), "alpha": 0.35}
        ax.add_collection3d(Poly3DCollection([factor * face], **style), autolim=False)
        points += list(face)
    for line in mechanism_lines(scene):
        if line.kind == LINK:
            ends = [factor * line.start, factor * line.end]
            style = {"colors": colours[line.body], "linewidths": line_width(2.5), "capstyle": "round"}
            ax.add_collection3d(Line3DCollection([ends], **style), autolim=False)
            points += [line.start, line.end]
    return points


def _name_joints(ax: Any, scene: Scene, factor: float) -> None:
    """Write the names of the first joints; joints at one point have theirs together."""
    names: dict[tuple[float, float, float], list[str]] = {}
    for joint in scene.joints[:_NAMED]:
        names.setdefault(joint.at, []).append(shortened(joint.name))
    for at, there in names.items():
        text = ax.text(*factor * np.array(at), f"  {', '.join(there)}", fontsize=7, va="top", zorder=7)
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])


def _draw_joint(ax: Any, joint: SceneJoint, size: float, factor: float) -> list[np.ndarray]:
    """Draw axis and positive turn of a joint; return its points, m."""
    at, axes = np.array(joint.at), joint_axes(joint)
    points = [at]
    marker = "s" if GROUND in (joint.first, joint.second) else "o"
    ax.plot(*factor * at[:, None], marker, color=_AXIS, markersize=4, zorder=5)
    if joint.axis is not None:
        tip = at + _ARROW * size * axes[2]
        _arrow(ax, factor * np.array([at, tip]), axes[0], factor * _RADIUS * size)
        points.append(tip)
    if joint.kind in _TURNING:
        turn = np.linspace(0.0, 1.5 * np.pi, 40)[:, None]
        arc = at + 0.6 * _ARROW * size * axes[2] + _RADIUS * size * (np.cos(turn) * axes[0] + np.sin(turn) * axes[1])
        _arrow(ax, factor * arc, axes[0], factor * _RADIUS * size)
        points += list(arc)
    if joint.to is not None:
        ends = np.array([at, joint.to])
        ax.plot(*factor * ends.T, ":", color=_AXIS, linewidth=line_width(1.0), zorder=4)
        points.append(ends[1])
    return points


def _arrow(ax: Any, line: np.ndarray, across: np.ndarray, radius: float) -> None:
    """Draw a line (n, 3) with a head at its end, whose sides lie towards a vector and against it."""
    along = (line[-1] - line[-2]) / np.linalg.norm(line[-1] - line[-2])
    side = across - (across @ along) * along
    side /= np.linalg.norm(side) or 1.0
    head = [line[-1] - _HEAD * radius * (1.6 * along + sign * side) for sign in (-1.0, 1.0)]
    for part in (line, np.array([head[0], line[-1], head[1]])):
        ax.plot(*part.T, color=_AXIS, linewidth=line_width(1.0), zorder=6)
