"""Movies of the computed motion: animated GIF and MP4."""

from __future__ import annotations

from pathlib import Path

from fsm.errors import CaseError
from fsm.io.optional import optional_module
from fsm.results.solution import Solution
from fsm.views.exporters.registry import exporter
from fsm.views.plots.movie import SIZE, frames_of, write_gif

_RATE = 25.0
"""Frames of a movie per second."""

exporter("gif", "animated picture of the computed motion")(write_gif)


@exporter("mp4", "movie of the computed motion (H.264); needs fsm[video]")
def write_mp4(solution: Solution, path: Path) -> None:
    """Write a movie; a motion of less than 2 s or more than 20 s is shown in 8 s.

    Raises
    ------
    CaseError
        The package imageio-ffmpeg is not installed, or its program fails.
    """
    ffmpeg = optional_module("imageio_ffmpeg", "the export to mp4", "video")
    writer = ffmpeg.write_frames(str(path), SIZE, fps=_RATE, codec="libx264", macro_block_size=2, quality=7)
    try:
        writer.send(None)
        for picture in frames_of(solution, _RATE):
            writer.send(picture.tobytes())
    except OSError as error:
        raise CaseError(f"the program ffmpeg failed: {' '.join(str(error).split())[:200]}", "export") from None
    finally:
        writer.close()
