"""The code of the pages on extensions is executed block by block, as when the documentation is built."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGES = sorted((Path(__file__).parents[2] / "docs" / "extend").glob("*.md"))
BLOCK = re.compile(r"```\{executed\} (\w+)\n(?::file: (\S+)\n)?(.*?)```", re.S)


@pytest.mark.parametrize("page", [page for page in PAGES if page.stem != "index"], ids=lambda page: page.stem)
def test_the_page_runs(page: Path, tmp_path: Path) -> None:
    """Files are written, commands succeed, and the comparisons with closed forms hold."""
    blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
    assert sum(name.endswith(".py") for _, name, _ in blocks) == 1  # one of the files is the extension
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    environment = os.environ | {"PATH": path, "PYTHONPATH": str(PAGES[0].parents[2])}
    for language, name, text in blocks:
        if name:
            (tmp_path / name).write_text(text, encoding="utf-8")
            continue
        command = [sys.executable, "-c", text] if language == "python" else ["bash", "-euc", text]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"
        print(done.stdout)


def test_every_page_is_listed() -> None:
    index = (PAGES[0].parent / "index.md").read_text(encoding="utf-8")
    assert all(f"\n{page.stem}\n" in index for page in PAGES if page.stem != "index")
