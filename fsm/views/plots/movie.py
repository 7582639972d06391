"""Pictures of the computed motion at equal intervals of time, and the animated GIF of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fsm.io.atomic_write import atomic_write
from fsm.results.film import Floats
from fsm.results.solution import Solution
from fsm.text.shown_units import shown_unit
from fsm.views.plots.mesh import Mesh, mesh_of, playback
from fsm.views.plots.motion import leaves_plane
from fsm.views.plots.obstacles import obstacle_outlines
from fsm.views.plots.parts import OBSTACLE, vertical_axis
from fsm.views.plots.style import COLOURS, drive_units

SIZE = (960, 720)
"""Width and height of a picture, pixels."""
_FINER = 2
"""Factor of the size at which pictures are drawn, for smooth edges."""
_MARGIN = 70
_GIF_RATE = 12.5
"""Frames per second."""
_BRIGHT = [colour for colour in COLOURS if colour != "#000000"]
"""Colours of the parts."""
_AZIMUTH, _ELEVATION = np.radians(-60.0), np.radians(25.0)


def write_gif(solution: Solution, path: Path) -> None:
    """Write an animated GIF; a motion of less than 2 s or more than 20 s is shown in 8 s."""
    pictures = list(frames_of(solution, _GIF_RATE))
    palette = pictures[len(pictures) // 2].quantize(128)
    size = (SIZE[0] * 2 // 3, SIZE[1] * 2 // 3)
    small = [picture.resize(size).quantize(128, palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as part:
        small[0].save(part, format="GIF", save_all=True, append_images=small[1:], duration=1e3 / _GIF_RATE, loop=0)


def frames_of(solution: Solution, rate: float) -> Iterator[Image.Image]:
    """Pictures at a given rate (1/s) of the shown time; each picture shows the record that is nearest in time."""
    mesh = mesh_of(solution)
    scale = playback(mesh.time)
    duration = float(mesh.time[-1] - mesh.time[0])
    count = max(round(duration * scale * rate), 1)
    camera = _Camera(mesh)
    last, picture = -1, None
    for time in np.linspace(mesh.time[0], mesh.time[-1], count + 1):
        record = int(np.abs(mesh.time - time).argmin())
        if record != last or picture is None:
            picture, last = camera.picture(record), record
        yield picture


class _Camera:
    """Parallel projection that shows all records: along y for a plane motion, else from above."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.space = leaves_plane(mesh.solution.shape)
        low, high = mesh.points.min(axis=(0, 1)), mesh.points.max(axis=(0, 1))
        self.centre, self.reach = (low + high) / 2.0, 2.0 * float(np.linalg.norm(high - low))
        flat = self._flat(mesh.points)
        span = np.maximum(np.ptp(flat.reshape(-1, 3)[:, :2], axis=0), 1e-12)
        self.middle = (flat.reshape(-1, 3).max(axis=0) + flat.reshape(-1, 3).min(axis=0))[:2] / 2.0
        self.scale = _FINER * float(min((SIZE[0] - 2 * _MARGIN) / span[0], (SIZE[1] - 2 * _MARGIN) / span[1]))
        self.font = ImageFont.load_default(15 * _FINER)

    def _flat(self, points: Floats) -> Floats:
        """Coordinates to the right, upwards and towards the camera, m."""
        if not self.space:
            return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)
        ca, sa, ce, se = np.cos(_AZIMUTH), np.sin(_AZIMUTH), np.cos(_ELEVATION), np.sin(_ELEVATION)
        along = points @ np.array([ca * ce, sa * ce, se])
        return np.stack([points @ np.array([-sa, ca, 0.0]), points @ np.array([-ca * se, -sa * se, ce]), along], axis=-1)

    def _pixels(self, flat: Floats) -> Floats:
        size = np.array(SIZE) * _FINER / 2.0
        offset = (flat[..., :2] - self.middle) * self.scale
        return np.stack([size[0] + offset[..., 0], size[1] - offset[..., 1]], axis=-1)

    def picture(self, record: int) -> Image.Image:
        """Picture of a record with its time, and a scale of length."""
        picture = Image.new("RGB", (SIZE[0] * _FINER, SIZE[1] * _FINER), "white")
        draw = ImageDraw.Draw(picture)
        items = self._polygons(record)
        for _, polygon, colour in sorted(items, key=lambda item: item[0]):
            corners = [tuple(corner) for corner in polygon.tolist()]
            if len(corners) == 2 or not self.space:
                draw.line([*corners, corners[0]], fill=colour, width=2 * _FINER, joint="curve")
            if len(corners) > 2:
                draw.polygon(corners, fill=colour, outline="#333333" if self.space else colour)
        self._label(draw, record)
        return picture.reduce(_FINER)

    def _polygons(self, record: int) -> list[tuple[float, Floats, str]]:
        """Depth, corners in pixels, and colour of everything that is drawn."""
        mesh = self.mesh
        flat = self._flat(mesh.points[record])
        pixels = self._pixels(flat)
        found = []
        for cell, corners, label in zip(mesh.cells, mesh.corners, mesh.label, strict=True):
            chosen = cell[:corners]
            colour = _BRIGHT[int(label) % len(_BRIGHT)]
            shade = self._shade(mesh.points[record][chosen]) if self.space and corners > 2 else 1.0
            found.append((float(flat[chosen, 2].mean()), pixels[chosen], _shaded(colour, shade)))
        for outline in obstacle_outlines(mesh.solution, record, self.centre, self.reach):
            faces = outline.faces if self.space else [outline.section]
            for face in faces:
                corners_of_face = self._flat(np.asarray(face))
                depth = -np.inf if not outline.bounded else float(corners_of_face[:, 2].mean())
                found.append((depth, self._pixels(corners_of_face), OBSTACLE))
        return found

    def _shade(self, corners: Floats) -> float:
        """Brightness of a face, 0.6 to 1."""
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        size = float(np.linalg.norm(normal))
        return 0.6 + 0.4 * abs(float(normal @ np.array([0.3, -0.4, 0.866])) / size) if size else 1.0

    def _label(self, draw: ImageDraw.ImageDraw, record: int) -> None:
        mesh, width, height = self.mesh, SIZE[0] * _FINER, SIZE[1] * _FINER
        title = str(mesh.solution.layout.case.get("title", ""))[:80]
        draw.text((20 * _FINER, 14 * _FINER), title, fill="black", font=self.font)
        text = f"t = {mesh.time[record]:.4g} s"
        if mesh.solution.travel.shape[1]:
            text += f",  drive {drive_units(mesh.solution)[1].text(float(mesh.solution.travel[record, 0]))}"
        draw.text((20 * _FINER, 38 * _FINER), text, fill="black", font=self.font)
        length = _round_length(200 * _FINER / self.scale)
        end = 20 * _FINER + length * self.scale
        draw.line([(20 * _FINER, height - 24 * _FINER), (end, height - 24 * _FINER)], fill="black", width=2 * _FINER)
        draw.text((20 * _FINER, height - 46 * _FINER), shown_unit("m", length).text(length), fill="black", font=self.font)
        axes = "" if self.space else f"x to the right, {vertical_axis(mesh.solution)} upwards"
        draw.text((width - 20 * _FINER, height - 46 * _FINER), axes, fill="black", font=self.font, anchor="ra")


def _shaded(colour: str, factor: float) -> str:
    return "#" + "".join(f"{round(factor * int(colour[k : k + 2], 16)):02X}" for k in (1, 3, 5))


def _round_length(most: float) -> float:
    """Largest of 1, 2, 5, 10, ... below a length."""
    decade = 10.0 ** np.floor(np.log10(most))
    return float(max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= most))
