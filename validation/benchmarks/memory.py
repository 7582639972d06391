"""Peak memory of a few jobs, each in a separate process: `python -m validation.benchmarks.memory JOB` prints it in MB."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from fsm.model.compile.compile import compile_scene
from fsm.model.system.system import SegmentSystem
from validation.benchmarks.methods import METHODS
from validation.benchmarks.scenes import cantilever, roll_up, strip
from validation.benchmarks.segments import newton_iterations, time_steps

try:
    import resource
except ImportError:  # Windows does not provide this number
    resource = None  # type: ignore[assignment]

__all__ = ["measure_memory", "peak"]

ROOT = Path(__file__).parents[2]


def _large_chain() -> SegmentSystem:
    return compile_scene(cantilever(5000, ramp=10.0, damping=0.3))


JOBS: dict[str, Callable[[], object]] = {
    "import alone": lambda: None,
    "strip, 10 segments per panel, Radau": lambda: METHODS["Radau"].run(strip(), 1e-3),
    "roll-up, 200 segments, BDF": lambda: METHODS["BDF"].run(roll_up(), 1e-3),
    "chain of 5000, Newton iterations": lambda: newton_iterations(_large_chain(), "block", 5),
    "chain of 5000, steps of Radau": lambda: time_steps(_large_chain(), "Radau"),
}


def peak() -> float:
    """Largest resident size of this process so far, MB; nan if it is not available.

    On Linux a process inherits `ru_maxrss`: the value of a process that a large process has started includes the size of
    that process. `VmHWM` belongs to the process alone.
    """
    status = Path("/proc/self/status")
    if status.is_file():
        held = [line.split()[1] for line in status.read_text(encoding="ascii").splitlines() if line.startswith("VmHWM:")]
        if held:
            return 1024.0 * float(held[0]) / 1e6
    if resource is None:
        return float("nan")
    unit = 1.0 if sys.platform == "darwin" else 1024.0  # bytes on macOS, KiB on other systems
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6


def measure_memory() -> dict[str, float]:
    """Peak memory of every job, MB."""
    found = {}
    for job in JOBS:
        command = [sys.executable, "-m", "validation.benchmarks.memory", job]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SystemExit(f"{job} ended with {done.returncode}:\n{done.stderr}")
        found[job] = float(done.stdout)
        print(f"memory, {job}: {found[job]:.0f} MB", file=sys.stderr, flush=True)
    return found


def main() -> int:
    JOBS[sys.argv[1]]()
    print(peak())
    return 0


if __name__ == "__main__":
    sys.exit(main())
