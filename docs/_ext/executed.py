"""Tutorials that are executed when the pages are built.

    ```{executed} sh out/first/force.png
    fsm run case.toml --out out/first
    ```

shows the commands (`sh` or `python`), runs them in a folder of the page's own (in which `folding_cases` is at hand), and
shows what they print and the picture. The text of a block with any other file name, as in `toml case.toml`, is written
into this file and not run. A command that fails fails the build. FSM_DOCS_RUN=0 leaves the running out.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

PICTURES = Path("generated") / "tutorials"
LIMIT = 300.0
"""Longest time of one block, s."""


class Executed(SphinxDirective):
    """A block that is shown, and run."""

    has_content = True
    required_arguments = 1
    optional_arguments = 1
    option_spec: ClassVar[dict[str, Any]] = {"width": directives.unchanged}

    def run(self) -> list[nodes.Node]:
        """The text, what running it prints, and its picture."""
        text = "\n".join(self.content)
        language, name = (*self.arguments, "")[:2]
        shown = nodes.literal_block(text, text, language=language)
        result: list[nodes.Node] = [shown]
        folder = _folder(self.env.app, self.env.docname)
        if name and not name.endswith(".png"):
            result.insert(0, nodes.paragraph("", "", nodes.literal(name, name), nodes.Text(":")))
            (folder / name).write_text(text + "\n", encoding="utf-8")
            return result
        if not _running():
            return result
        command = [sys.executable, "-c", text] if language == "python" else ["bash", "-euc", text]
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
        environment = os.environ | {"PATH": path, "PYTHONPATH": str(_root(self.env.app))}
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=LIMIT, check=False
        )
        if done.returncode:
            raise self.error(f"{' '.join(command[:2])} ended with {done.returncode}:\n{text}\n{done.stdout}\n{done.stderr}")
        printed = done.stdout.replace(str(folder) + os.sep, "").rstrip()
        if printed:
            result.append(nodes.literal_block(printed, printed, language="text", classes=["printed"]))
        if name:
            result.append(self._picture(folder / name))
        return result

    def _picture(self, path: Path) -> nodes.Node:
        if not path.is_file():
            raise self.error(f"there is no picture {path.name}")
        name = f"{self.env.docname.replace('/', '-')}-{path.parent.name}-{path.name}"
        target = Path(self.env.srcdir) / PICTURES / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)
        image = nodes.image(uri="/" + (PICTURES / name).as_posix(), alt=path.stem)
        image["width"] = self.options.get("width", "85%")
        return image


def _running() -> bool:
    return os.environ.get("FSM_DOCS_RUN", "1") != "0"


def _root(app: Sphinx) -> Path:
    return Path(app.srcdir).parent


def _folder(app: Sphinx, page: str) -> Path:
    """The folder that a page's commands run in; new with every build of the page."""
    folder = Path(app.outdir).parent / "tutorials" / page.replace("/", "-")
    if page not in _MADE:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        shutil.copytree(_root(app) / "folding_cases", folder / "folding_cases")
        _MADE.add(page)
    return folder


_MADE: set[str] = set()


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_directive("executed", Executed)
    return {"version": "1", "parallel_read_safe": False, "parallel_write_safe": True}
