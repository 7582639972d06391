"""JavaScript libraries of the report, read from packages of the Python index and embedded in the page.

`plotly` has plotly.js for the curves, and `trimesh` has three.js for the player. The packages are found, but not imported.
docs/report.md compares them with other packages in size and speed.
"""

from __future__ import annotations

import importlib.util
import io
import zipfile
from collections.abc import Callable
from pathlib import Path

from fsm.errors import FsmError

_THREE_BEGIN, _THREE_END = "<script>", 'Object.defineProperty(t,"__esModule",{value:!0})}));'
"""Begin and end of three.js in the viewer page of trimesh."""


class MissingLibrary(FsmError):
    """A package with a JavaScript library is not installed, or has another layout."""

    exit_code = 2


def _plotly(folder: Path) -> str:
    return (folder / "package_data" / "plotly.min.js").read_text(encoding="utf-8")


def _three(folder: Path) -> str:
    with zipfile.ZipFile(io.BytesIO((folder / "resources" / "templates" / "viewer.zip").read_bytes())) as archive:
        page = archive.read("viewer.html.template").decode("utf-8")
    begin = page.index(_THREE_BEGIN) + len(_THREE_BEGIN)
    return page[begin : page.index(_THREE_END, begin) + len(_THREE_END)]


_READERS: dict[str, tuple[str, Callable[[Path], str]]] = {"plotly": ("plotly", _plotly), "three": ("trimesh", _three)}


def library(name: str) -> str:
    """Source text of a JavaScript library, "plotly" or "three".

    Raises
    ------
    MissingLibrary
        Its package is not installed, or does not contain the library where it is expected.
    """
    package, read = _READERS[name]
    found = importlib.util.find_spec(package)
    if found is None or not found.submodule_search_locations:
        raise MissingLibrary(f"the package {package} is not installed; a report needs it: pip install {package}")
    try:
        return read(Path(next(iter(found.submodule_search_locations))))
    except (OSError, ValueError, LookupError, zipfile.BadZipFile) as error:
        text = f"the package {package} does not contain {name}.js where it is expected ({error}); install it again"
        raise MissingLibrary(text) from error
