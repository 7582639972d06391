"""Run the tests as on other processors: with other BLAS kernels, and with other machine code of numba.

    python -m tests.machines [--one] [arguments of pytest]

Round-off differs between processors, because OpenBLAS and numba choose instructions by the processor. A bound that depends
on round-off is valid on one machine only. Each setting below runs in its own processes. A setting that this processor cannot
run is skipped and named in the closing table. `--one` runs the first setting that differs from the default of this machine.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass

__all__ = ["SETTINGS", "Setting", "run"]


@dataclass(frozen=True)
class Setting:
    """An environment variable that chooses machine code, and its value."""

    variable: str
    value: str

    def __str__(self) -> str:
        return f"{self.variable}={self.value}"


SETTINGS = (
    Setting("OPENBLAS_CORETYPE", "Haswell"),
    Setting("OPENBLAS_CORETYPE", "SkylakeX"),
    Setting("OPENBLAS_CORETYPE", "Prescott"),
    Setting("NUMBA_CPU_NAME", "generic"),
)

_PROBE = """
import json
import numpy as np
import scipy.linalg
import threadpoolctl
from numba import njit
from numba.core.registry import cpu_target

matrix = np.eye(50) + np.ones((50, 50))
scipy.linalg.solve(matrix, matrix)
njit(lambda x: x @ x)(matrix)
libraries = [found for found in threadpoolctl.threadpool_info() if found["internal_api"] == "openblas"]
print(json.dumps({
    "OPENBLAS_CORETYPE": sorted({str(found.get("architecture")) for found in libraries}),
    "NUMBA_CPU_NAME": [cpu_target.target_context.codegen().magic_tuple()[1]],
}))
"""


def _found(setting: Setting | None) -> list[str] | dict[str, list[str]] | None:
    """Processor types that the libraries use under a setting; without a setting, those of all variables; None where they
    crash."""
    chosen = {} if setting is None else {setting.variable: setting.value}
    clean = {name: value for name, value in os.environ.items() if name not in {each.variable for each in SETTINGS}}
    done = subprocess.run([sys.executable, "-c", _PROBE], env=clean | chosen, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return None
    found: dict[str, list[str]] = json.loads(done.stdout)
    return found if setting is None else found[setting.variable]


def run(arguments: list[str]) -> int:
    """Run pytest under each setting that this processor supports; returns the worst exit code."""
    one = "--one" in arguments
    arguments = [argument for argument in arguments if argument != "--one"]
    own = _found(None)
    if not isinstance(own, dict):
        print("NumPy, SciPy and numba do not run here", file=sys.stderr)
        return 1
    print(f"this machine: {own}", flush=True)
    lines, worst, done = [], 0, 0
    for setting in SETTINGS:
        found = _found(setting)
        if found is None or (found != [setting.value] and found == own[setting.variable]):
            lines.append(f"{setting}: skipped, this processor cannot run it ({'crash' if found is None else found})")
        elif one and (done or found == own[setting.variable]):
            lines.append(f"{setting}: {'not asked for' if done else 'what this machine chooses by itself'}")
        else:
            print(f"== {setting}", flush=True)
            environment = os.environ | {setting.variable: setting.value}
            code = subprocess.run([sys.executable, "-m", "pytest", *arguments], env=environment, check=False).returncode
            lines.append(f"{setting}: {'passed' if code == 0 else f'pytest ended with exit code {code}'}")
            worst, done = max(worst, code), done + 1
    print("\n".join(lines))
    return worst


if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
