"""Pages with steps to follow run as they are shown: their files, commands, comparisons and pictures."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for part in ("howto", "extend") for path in (ROOT / "docs" / part).glob("*.md") if path.stem != "index")
SMALL = ("channel",)
_BLOCK = re.compile(r"^```\{executed\} (\w+) ?(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize(
    "page",
    [pytest.param(path, marks=[pytest.mark.nightly] * (path.stem not in SMALL)) for path in PAGES],
    ids=[path.stem for path in PAGES],
)
def test_the_page_runs(page: Path, tmp_path: Path) -> None:
    (tmp_path / "folding_cases").symlink_to(ROOT / "folding_cases")
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT)}
    blocks = _BLOCK.findall(page.read_text(encoding="utf-8"))
    assert any(not name or name.endswith(".png") for _, name, _ in blocks)
    for language, name, text in blocks:
        if name and not name.endswith(".png"):
            (tmp_path / name).write_text(text, encoding="utf-8")
            continue
        command = [sys.executable, "-c", text] if language == "python" else ["bash", "-euc", text]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"
        assert "not physical" not in done.stdout + done.stderr
        assert not name or (tmp_path / name).stat().st_size > 1000


@pytest.mark.parametrize("page", PAGES, ids=[path.stem for path in PAGES])
def test_the_page_is_listed(page: Path) -> None:
    assert page.stem in (page.parent / "index.md").read_text(encoding="utf-8")
