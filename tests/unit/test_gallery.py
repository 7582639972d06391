"""The gallery's protocol: which checks are red, the effect of a missing picture, and which folders take part."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from validation.gallery import folders, run
from validation.gallery.pages import write_gallery
from validation.gallery.record import Check, NotCompared, Place, Reason, against, below, said


def picture(place: Place, name: str = "curve.png") -> Path:
    place.out.mkdir(parents=True, exist_ok=True)
    path = place.out / name
    path.write_bytes(b"png")
    return path


AIR = Reason("air is missing", 1.01, 1e-3)


def part(place: Place) -> Iterator[Check | NotCompared]:
    """Three checks, and the checks that were left out."""
    there = picture(place)
    yield against("good", "case", 1.001, 1.0, "closed form", there, rtol=2e-3, unit="N")
    yield against("bad", "case", 1.01, 1.0, "closed form", there, rtol=2e-3, unit="N", reason=AIR)
    yield said("order <of> & things", "a is above b", "paper, figure 1", "a 2, b 1", True, there)
    yield NotCompared("curve", "paper, figure 2", "only a picture")


def test_out_of_tolerance_is_red_and_says_why(tmp_path: Path) -> None:
    good, bad, statement = (item for item in part(Place(tmp_path)) if isinstance(item, Check))
    assert good.passed and not good.told
    assert not bad.passed
    assert bad.told == "error 0.01, allowed 0.002: air is missing"
    assert statement.passed
    assert not said("x", "a", "b", "c", False, tmp_path).passed


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_what_is_no_number_is_red(value: float, tmp_path: Path) -> None:
    assert not against("x", "", value, 1.0, "", tmp_path, rtol=1e9).passed
    assert not against("x", "", value, 1.0, "", tmp_path, atol=1e9).passed


def test_bounds(tmp_path: Path) -> None:
    assert below("x", "", 1.0, 1.0, "", tmp_path).passed
    assert not below("x", "", 1.0 + 1e-12, 1.0, "", tmp_path).passed
    with pytest.raises(ValueError, match="rtol or atol"):
        against("x", "", 1.0, 1.0, "", tmp_path)
    with pytest.raises(ValueError, match="rtol or atol"):
        against("x", "", 1.0, 1.0, "", tmp_path, rtol=1.0, atol=1.0)


def test_a_missing_or_empty_picture_fails(tmp_path: Path) -> None:
    def without(place: Place) -> Iterator[Check]:
        yield below("nothing", "", 0.0, 1.0, "", place.out / "nowhere.png")
        yield below("empty", "", 0.0, 1.0, "", place.out / "empty.png")
        (place.out / "empty.png").touch()
        yield below("late", "", 0.0, 1.0, "", place.out / "late.png")
        picture(place, "late.png")  # drawn when all results are known

    checks = run.collect(without, Place(tmp_path))["checks"]
    assert [check["passed"] for check in checks] == [False, False, True]
    assert "no picture nowhere.png" in checks[0]["told"]


def test_a_part_that_raises_is_red_and_keeps_what_it_had(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def broken(place: Place) -> Iterator[Check]:
        yield below("first", "", 0.0, 1.0, "", picture(place))
        raise RuntimeError("did not converge\nand more")

    first, second = run.collect(broken, Place(tmp_path))["checks"]
    assert first["passed"] and not second["passed"]
    assert second["value"] == "RuntimeError: did not converge"
    assert "did not converge" in capsys.readouterr().err


def test_the_page_shows_every_check_and_every_reason(tmp_path: Path) -> None:
    kept = {"folder/part": run.collect(part, Place(tmp_path / "out")) | {"folder": "A folder", "what": "A part"}}
    run.write(tmp_path / "checks.json", kept)
    assert not list(tmp_path.glob("*.part"))
    write_gallery(tmp_path / "checks.json", tmp_path / "pages")
    page = (tmp_path / "pages" / "gallery.md").read_text(encoding="utf-8")
    escaped = "order &lt;of&gt; &amp; things"
    for text in ("2 green", "1 red", "air is missing", escaped, "only a picture", "closed form", "A part"):
        assert text in page, text
    (shown,) = (tmp_path / "pages" / "extra" / "gallery_pictures").iterdir()
    assert shown.name in page
    # the protocol names checks that were not run
    write_gallery(tmp_path / "none.json", tmp_path / "pages")
    assert "make validate" in (tmp_path / "pages" / "gallery.md").read_text(encoding="utf-8")


class Folder:
    """Replaces a module of a folder."""

    TITLE = "A folder"

    def __init__(self) -> None:
        self.calls = 0
        self.PARTS = {"part": self.part}

    def part(self, place: Place) -> Iterator[Check | NotCompared]:
        """A part."""
        self.calls += 1
        yield from part(place)


def test_what_is_done_is_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Folder()
    monkeypatch.setattr(run, "checks_of", lambda name: folder)
    monkeypatch.setattr(run, "fingerprint", lambda: "one")
    told: list[str] = []
    # red for a known reason, which is not a failure of the run
    assert run.run(["folder"], tmp_path, say=told.append) == 0
    assert any("RED bad" in line for line in told)
    assert run.run(["folder"], tmp_path, say=told.append) == 0
    assert folder.calls == 1
    run.run(["folder/part"], tmp_path, again=True, say=told.append)
    run.run(["folder"], tmp_path, full=True, say=told.append)
    monkeypatch.setattr(run, "fingerprint", lambda: "two")
    run.run(["folder"], tmp_path, say=told.append)
    assert folder.calls == 4
    kept = json.loads((tmp_path / "checks.json").read_text(encoding="utf-8"))
    assert list(kept["parts"]) == ["folder/part"]


def test_red_without_a_reason_is_a_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Bad(Folder):
        def part(self, place: Place) -> Iterator[Check | NotCompared]:
            yield below("x", "", 2.0, 1.0, "", picture(place))

    folder = Bad()
    monkeypatch.setattr(run, "checks_of", lambda name: folder)
    assert run.run(["folder"], tmp_path, say=lambda line: None) == 1


@pytest.mark.parametrize(
    ("value", "explained"), [(1.5, True), (1.51, True), (1.6, False), (3.0, False), (float("nan"), False)]
)
def test_a_reason_excuses_only_the_value_it_was_found_for(
    value: float, explained: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    why = Reason("air is missing", 1.5, 0.02)

    class Red(Folder):
        def part(self, place: Place) -> Iterator[Check | NotCompared]:
            there = picture(place)
            yield below("bound", "", value, 1.0, "", there, reason=why)
            yield against("number", "", value, 1.0, "", there, rtol=0.01, reason=why)
            yield said("words", "a", "b", "c", False, there, reason=why, number=value)

    folder = Red()
    monkeypatch.setattr(run, "checks_of", lambda name: folder)
    told: list[str] = []
    assert run.run(["folder"], tmp_path, say=told.append) == int(not explained)
    red = [line for line in told if "RED" in line]
    assert len(red) == 3
    assert all(("not explained" in line) != explained for line in red)


def test_a_statement_with_a_reason_gives_its_number(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="words: a statement with a reason needs the number"):
        said("words", "a", "b", "c", False, tmp_path, reason=AIR)


def test_every_folder_takes_part_or_says_why_not() -> None:
    there = {path.parent.name for path in folders.ROOT.glob("*/README.md")}
    assert set(folders.folders()) | set(folders.NOT_IN_GALLERY) == there
    assert not set(folders.folders()) & set(folders.NOT_IN_GALLERY)
    for reason in folders.NOT_IN_GALLERY.values():
        assert len(reason) > 10
    for folder in folders.folders():
        module = folders.checks_of(folder)
        assert module.TITLE and module.PARTS, folder
        for name, function in module.PARTS.items():
            assert function.__doc__, f"{folder}/{name}"
