"""Animated GIF of a plane motion."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

from fsm.io.atomic_write import atomic_write
from fsm.results.solution import Solution
from fsm.views.plots.parts import colours_of_parts
from fsm.views.plots.plane import vertical_axis
from fsm.views.plots.style import figure_unit, rounded, styled

_WIDTH, _DPI = 5.6, 100
"""Width of a frame, inches, and its resolution."""
_FRAMES, _MILLISECONDS = 100, 50
"""Largest number of frames, and duration of each."""


def animate(solution: Solution, path: str | Path) -> None:
    """Write an animated GIF of the shape over time, with at most 100 equally spaced records; plates appear as lines.

    Parameters
    ----------
    solution : Solution
        Motion in the x-z plane, or of a scissor array in the x-y plane.
    path : path of the file; its folder is created
    """
    unit = figure_unit("m", np.ptp(solution.shape.reshape(-1, 3), axis=0))
    corners = unit.factor * solution.shape[..., [0, 2]]
    ends = np.stack([corners[:, :, [0, 3]].mean(axis=2), corners[:, :, [1, 2]].mean(axis=2)], axis=2)
    low, high = corners.reshape(-1, 2).min(axis=0), corners.reshape(-1, 2).max(axis=0)
    margin = 0.05 * float((high - low).max())
    ratio = float((high - low)[1] + 2.0 * margin) / float((high - low)[0] + 2.0 * margin)
    chosen = np.unique(np.linspace(0, len(solution) - 1, min(_FRAMES, len(solution))).round().astype(int))
    frames = []
    with matplotlib.rc_context(styled()):
        fig = Figure(figsize=(_WIDTH, min(max(_WIDTH * ratio + 0.6, 1.8), 8.0)), dpi=_DPI, layout="constrained")
        canvas = FigureCanvasAgg(fig)
        ax = fig.subplots()
        plates = LineCollection(list(ends[0]), colors=colours_of_parts(solution), linewidths=2.2, capstyle="round")
        ax.add_collection(plates)
        ax.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
        ax.set(xlabel=f"x ({unit.name})", ylabel=f"{vertical_axis(solution)} ({unit.name})")
        ax.set_aspect("equal", adjustable="box")
        title = ax.set_title("0 s")
        canvas.draw()
        # only the plates and the title are drawn again for every frame, because drawing the whole figure would take several
        # times as long
        fig.set_layout_engine("none")
        plates.set_animated(True)
        title.set_animated(True)
        canvas.draw()
        background = canvas.copy_from_bbox(fig.bbox)
        for record in chosen:
            plates.set_segments(list(ends[record]))
            title.set_text(f"{rounded(float(solution.time[record]))} s")
            canvas.restore_region(background)
            ax.draw_artist(plates)
            ax.draw_artist(title)
            frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    palette = frames[0].quantize(64)
    pictures = [frame.quantize(64, palette=palette) for frame in frames]
    with atomic_write(path) as part:
        pictures[0].save(part, save_all=True, append_images=pictures[1:], duration=_MILLISECONDS, loop=0)
