"""Openings of ideal joints, their rates, energy error and reproducibility after 100,000 explicit steps.

    python -m validation.peers.drift [--only A01 heavy_top wing A02]      # two minutes
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from fsm.model.elements.joints import JointGroup
from fsm.model.system.system import SegmentSystem
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.peers import rigid

_STEPS = 100_000
_CASES = {
    "A01": (rigid.pendulum_model, 1000.0),
    "heavy_top": (rigid.top_model, 100.0),
    "wing": (rigid.wing_model, 1000.0),
    "A02": (rigid.four_bars_model, 40.0),
}
"""Model and duration, s."""


def openings(system: SegmentSystem, state: SavedState) -> tuple[float, float]:
    """Largest opening (m or rad) and largest rate of an opening."""
    group = next(group for group in system.groups if isinstance(group, JointGroup))
    poses, rates = system.place(state.time, state.q, state.u)
    values, gradients = group.openings(poses)
    of_bodies = gradients.reshape(-1, 2, 6) * rates[group.bodies]
    return float(np.abs(values).max()), float(np.abs(of_bodies.sum(axis=(1, 2))).max())


def run(name: str) -> tuple[bytes, str]:
    """State at the end as bytes, and a row of the table."""
    make, end = _CASES[name]
    system, _ = make()
    saved: list[SavedState] = []
    begun = time.process_time()
    settings = Settings("explicit", 1e-9, end, max_step=end / _STEPS)
    statistics, balance = simulate(system, settings, [0.25 * end * k for k in range(1, 5)], saved.append)
    taken = time.process_time() - begun
    worst = np.max([openings(system, state) for state in saved], axis=0)
    row = f"| {name} | {statistics.steps} | {worst[0]:.1e} | {worst[1]:.1e} | {balance.relative_error:.1e} | {taken:.1f} |"
    return saved[-1].q.tobytes() + saved[-1].u.tobytes(), row


def main() -> None:
    """Print the table; each case runs twice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", choices=_CASES, default=list(_CASES))
    print("| case | steps | opening | rate of an opening | energy error | time, s | same bits twice |")
    print("|---|---|---|---|---|---|---|")
    for name in parser.parse_args().only:
        (first, _), (second, row) = run(name), run(name)
        print(f"{row} {'yes' if first == second else 'no'} |", flush=True)


if __name__ == "__main__":
    main()
