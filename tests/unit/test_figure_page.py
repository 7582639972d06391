"""Page of all kinds of figures: complete, with small pictures."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from fsm.case.loading.table import OVERLAY, STUDY
from fsm.views.plots import figures
from fsm.views.plots.style import COLOURS

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_shows_every_kind_of_figure() -> None:
    page = (DOCS / "figures.md").read_text(encoding="utf-8")
    kinds = {*figures._ALL, OVERLAY, STUDY, "channels.png", "curves.png", "residuals.png", "loops.png"}
    assert {kind for kind in kinds if f"`{kind}`" not in page} == set()


def test_the_pictures_of_the_page_are_there_and_small() -> None:
    page = (DOCS / "figures.md").read_text(encoding="utf-8")
    named = re.findall(r"\{image\} (figures/\S+)", page)
    assert len(named) > 25
    assert {f"figures/{path.name}" for path in (DOCS / "figures").glob("*.png")} == set(named)
    for name in named:
        assert (DOCS / name).stat().st_size < 100_000
        with Image.open(DOCS / name) as picture:
            assert picture.width <= 720


def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("figure_page", DOCS / "figures" / "draw.py")
    assert spec is not None and spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_the_page_is_the_text_of_its_script() -> None:
    assert script().page() == (DOCS / "figures.md").read_text(encoding="utf-8")


def test_thin_lines_keep_their_colours(tmp_path: Path) -> None:
    """Median cuts of the palette gave two panels of a strip, and two of five channels, the same colour."""
    picture = Image.new("RGB", (600, 600), "white")
    picture.paste(Image.linear_gradient("L").resize((600, 500)), (0, 100))
    for k, colour in enumerate(COLOURS):
        picture.paste(colour, (10, 10 * k, 60, 10 * k + 2))
    picture.save(tmp_path / "large.png")
    script().small(tmp_path / "large.png", tmp_path / "small.png")
    with Image.open(tmp_path / "small.png") as found:
        small = np.asarray(found.convert("RGB"), dtype=int)
    for k, colour in enumerate(COLOURS):
        assert np.abs(small[10 * k, 30] - np.array(to_rgb(colour)) * 255).max() < 20
