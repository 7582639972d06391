"""Arguments of kernels: few, with arrays that belong together in named tuples."""

import ast
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fsm.kernels.jit import compiled_as

PACKAGE = Path(__file__).parents[2] / "fsm"
MOST = 14


def is_kernel(decorator):
    name = decorator.func if isinstance(decorator, ast.Call) else decorator
    return isinstance(name, ast.Name) and name.id in ("kernel", "shared")


def kernels():
    """Number of arguments of every kernel, by file and name."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and any(map(is_kernel, node.decorator_list)):
                own = node.args
                yield f"{path.relative_to(PACKAGE)}: {node.name}", len(own.posonlyargs + own.args + own.kwonlyargs)


def test_no_kernel_has_more_than_fourteen_arguments():
    counted = dict(kernels())
    assert len(counted) > 300
    assert {name: count for name, count in counted.items() if count > MOST} == {}


def test_functions_of_compiled_models_have_names_of_their_own() -> None:
    """Two libraries from the cache that name different functions alike would both use the one that is loaded first."""

    class Model(NamedTuple):
        arrays: np.ndarray

    def function_of(number: int) -> tuple[Any, Any]:
        def asked(model: Any) -> int:
            return 0

        def instead(model: Any) -> int:
            return number

        asked.__qualname__ = f"function {number}"
        return asked, instead

    pairs = [function_of(number) for number in range(3)]
    for asked, instead in pairs:
        compiled_as(asked, Model, instead)
    assert len({instead.__qualname__ for _, instead in pairs}) == 3
