"""Figures of a result for notebooks and files."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from fsm.errors import NotInResult
from fsm.results.all_channels import all_channels
from fsm.results.channel import select_channels
from fsm.results.solution import Solution

_FORMATS = (".png", ".svg", ".pdf")


class Picture:
    """Figure as an image, which a notebook shows.

    Attributes
    ----------
    data : bytes
        Content of the file.
    kind : str
        ".png", ".gif", ".svg" or ".pdf".

    Examples
    --------
    >>> import fsm
    >>> result = fsm.load("folding_cases/rotating_squares/case.toml").set("drive.0.travel", 0.14).run()
    >>> result.plot("force").kind
    '.png'
    """

    def __init__(self, data: bytes, kind: str, name: str) -> None:
        self.data, self.kind, self.name = data, kind, name

    def save(self, path: str | Path) -> Path:
        """Write the image; return its path."""
        from fsm.io.atomic_write import atomic_write

        with atomic_write(path) as part:
            part.write_bytes(self.data)
        return Path(path)

    def _repr_png_(self) -> bytes | None:
        return self.data if self.kind == ".png" else None

    def _repr_html_(self) -> str | None:
        import base64

        if self.kind != ".gif":
            return None
        return f'<img alt="motion" src="data:image/gif;base64,{base64.b64encode(self.data).decode()}">'

    def __repr__(self) -> str:
        return f"Picture({self.name!r}, {len(self.data) / 1024:.0f} kB {self.kind.removeprefix('.')})"


def draw_picture(solution: Solution, names: Sequence[str], what: Sequence[str], out: Path | None, source: Path) -> Picture:
    """Draw a figure of the run, or channels.

    Raises
    ------
    NotInResult
        There is no such figure or channel, or the format of `out` is unknown.
    """
    from fsm.views.plots.channels import plot_channels
    from fsm.views.plots.figures import figures_of

    figures = {name.removesuffix(".png"): (name, plot) for name, plot in figures_of(solution).items()}
    if not what and not figures:
        raise NotInResult(f"{source}: no figure can be drawn, because the result has only one record; name a channel")
    chosen = list(what) or [next(iter(figures))]
    suffix = ".png" if out is None else out.suffix.lower()
    if out is not None and suffix not in _FORMATS:
        raise NotInResult(f"{out}: unknown format {suffix or 'without a suffix'}; give a name with {', '.join(_FORMATS)}")
    with tempfile.TemporaryDirectory(prefix="fsm-") as folder:
        if len(chosen) == 1 and chosen[0] in figures:
            name, plot = figures[chosen[0]]
            suffix = suffix if name.endswith(".png") else Path(name).suffix
            path = Path(folder) / f"figure{suffix}"
            plot(solution, path)
        else:
            _, faults = select_channels(names, chosen, "plot")
            if faults:
                known = ", ".join(figures)
                raise NotInResult(f"{source}: {faults[0].message}; figures of this result: {known or 'none'}")
            path = Path(folder) / f"channels{suffix}"
            every = _with_channels(solution)
            plot_channels(every, chosen, path)
        picture = Picture(path.read_bytes(), suffix, chosen[0])
    if out is not None:
        picture.save(out)
    return picture


def _with_channels(solution: Solution) -> Solution:
    """Solution whose channels also include drives, energies and contacts."""
    from dataclasses import replace

    return replace(solution, channels=all_channels(solution))
