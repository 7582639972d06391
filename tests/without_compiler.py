"""Results of a test module in a process without the compiler."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

PROGRAM = """
import importlib, importlib.util, pickle, sys
path, what, holder, kernel = sys.argv[1:]
spec = importlib.util.spec_from_file_location("evaluation", path)
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
assert not hasattr(getattr(importlib.import_module(holder), kernel), "signatures"), "compiled after all"
sys.stdout.buffer.write(pickle.dumps(eval(what)))
"""


def without_compiler(path: str, kernel: str, what: str = "module.evaluate()") -> Any:
    """Value of `what` of the module at a path; `kernel` is a kernel that it reaches, with its module."""
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, path, what, *kernel.rsplit(".", 1)],
        cwd=Path(__file__).parents[1], env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr.decode()
    return pickle.loads(result.stdout)
