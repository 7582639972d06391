"""Fixtures of the unit tests."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from fsm.views.plots import style


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are saved during a test."""
    saved: list[Figure] = []
    save = style._save

    def keep(figure: Figure, path: Path) -> None:
        saved.append(figure)
        save(figure, path)

    monkeypatch.setattr(style, "_save", keep)
    return saved
