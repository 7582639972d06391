"""Imports of the package: no circle, also not by imports for types or inside functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import fsm

_ROOT = Path(fsm.__file__).parent


def _name(path: Path) -> str:
    parts = ("fsm", *path.relative_to(_ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


_MODULES = {_name(path): path for path in sorted(_ROOT.rglob("*.py"))}


def _imported(node: ast.AST, lazy: bool) -> Iterator[tuple[str, bool]]:
    """Names that a part of a module imports, and whether inside a function."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            yield from ((alias.name, lazy) for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            assert child.level == 0, "full names only"
            for alias in child.names:
                inner = f"{child.module}.{alias.name}"
                yield inner if inner in _MODULES else str(child.module), lazy
        else:
            yield from _imported(child, lazy or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda))


@pytest.fixture(scope="module")
def imports() -> dict[str, list[tuple[str, bool]]]:
    return {name: list(_imported(ast.parse(path.read_bytes()), False)) for name, path in _MODULES.items()}


@pytest.mark.parametrize("functions", [False, True], ids=["at the top and for types", "also inside functions"])
def test_no_circle_of_imports(imports: dict[str, list[tuple[str, bool]]], functions: bool) -> None:
    graph = {
        name: {one for one, lazy in found if (functions or not lazy) and one in _MODULES and one != name}
        for name, found in imports.items()
    }
    assert "fsm.solve.interface.records" in graph["fsm.model.system.system"]
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))
