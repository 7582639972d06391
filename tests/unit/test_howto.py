"""Every how-to page runs as it is shown: its files, commands and pictures."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for path in (ROOT / "docs" / "howto").glob("*.md") if path.stem != "index")
_BLOCK = re.compile(r"^```\{executed\} (\w+)\n((?::\w+:[^\n]*\n)*)(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=[path.stem for path in PAGES])
def test_the_page_runs(page: Path, tmp_path: Path) -> None:
    (tmp_path / "folding_cases").symlink_to(ROOT / "folding_cases")
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(ROOT)}
    blocks = _BLOCK.findall(page.read_text(encoding="utf-8"))
    assert blocks
    for language, given, text in blocks:
        options = dict(re.findall(r":(\w+): ([^\n]*)", given))
        if "file" in options:
            (tmp_path / options["file"]).write_text(text, encoding="utf-8")
            continue
        command = [sys.executable, "-c", text] if language == "python" else ["bash", "-euc", text]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "not physical" not in done.stdout + done.stderr
        assert "picture" not in options or (tmp_path / options["picture"]).stat().st_size > 1000
