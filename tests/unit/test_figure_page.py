"""Page of all kinds of figures: complete, with small pictures."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

from PIL import Image

from fsm.plots import figures
from fsm.scene.table import OVERLAY, STUDY

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


def test_the_page_is_the_text_of_its_script() -> None:
    spec = importlib.util.spec_from_file_location("figure_page", DOCS / "figures" / "draw.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert script.page() == (DOCS / "figures.md").read_text(encoding="utf-8")
