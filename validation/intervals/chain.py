"""Coverage of the bands of `fsm study`, from a bench test to a response, over synthetic studies.

    python -m validation.intervals.chain [--studies 200] [--seed 1]

In each study a crease has a true stiffness, and five specimens with a scatter of 4 % about it are tested, with noise.
`fsm calibrate crease` gives the mean stiffness with its standard error. Thickness and modulus are measured with known
errors. `fsm study` varies the three, 256 runs, for a closed form of the force of a folded strip. The true force shall lie in
the 95 % band in 92 to 98 % of the studies. The bound is that of 200 studies: the standard deviation of the part is 1.5 %.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from pathlib import Path

import numpy as np

import fsm
from fsm.studies.study import run_study

LEVEL, WANTED = 0.95, (0.92, 0.98)
STIFFNESS, THICKNESS, YOUNG = 9e-3, 3e-4, 3e9
ANGLES = np.radians(np.linspace(5.0, 60.0, 12))
MODEL = """
def force(k, t, e):
    bending = e * 0.04 * t**3 / 12.0 / 0.08
    return k * bending / (k + bending) * 1.3 / 0.08 * 6.0
"""


def true_force(k: float, t: float, e: float) -> float:
    """Force of a crease and a panel in series, N; the closed form of the studies."""
    found: dict[str, float] = {}
    exec(MODEL, found)
    return float(found["force"](k, t, e))  # type: ignore[operator]


def covered(rng: np.random.Generator, folder: Path) -> bool:
    """Whether the band of one synthetic study contains the true force."""
    k = STIFFNESS * float(np.exp(0.3 * rng.normal()))
    t, e = THICKNESS * (1.0 + 0.1 * float(rng.normal())), YOUNG * (1.0 + 0.1 * float(rng.normal()))
    with (folder / "crease.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["angle (deg)", "moment (N mm)", "repeat"])
        for repeat in range(1, 6):
            own = k * (1.0 + 0.04 * rng.normal())
            for angle in ANGLES:
                moment = own * angle + 0.005 * k * rng.normal()
                writer.writerow([f"{np.degrees(angle):.6g}", f"{1e3 * moment:.8g}", repeat])
    fsm.calibrate("crease", folder / "crease.csv", out=folder / "bench")
    measured_t, measured_e = t + 0.02 * THICKNESS * rng.normal(), e + 0.03 * YOUNG * rng.normal()
    (folder / "model.py").write_text(MODEL)
    (folder / "study.toml").write_text(f"""
function = "model.py:force"
level = {LEVEL}
seed = {int(rng.integers(1 << 30))}
design = {{ kind = "latin", sample = 256 }}
response = [{{ name = "force", unit = "N" }}]
parameter = [
    {{ path = "k", posterior = "bench/calibration.json", quantity = "curve: mean stiffness" }},
    {{ path = "t", distribution = "normal", mean = {measured_t}, sigma = {0.02 * THICKNESS} }},
    {{ path = "e", distribution = "normal", mean = {measured_e}, sigma = {0.03 * YOUNG} }},
]
""")
    low, _, high = run_study(folder / "study.toml", folder / "out", workers=1, progress=False, page=False).quantiles("force")
    return low <= true_force(k, t, e) <= high


def main() -> None:
    """Print the part of the studies whose band contains the true force."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    inside = 0
    for number in range(options.studies):
        with tempfile.TemporaryDirectory() as folder:
            inside += covered(np.random.default_rng([options.seed, number]), Path(folder))
    part = inside / options.studies
    kept = WANTED[0] <= part <= WANTED[1]
    print(f"{inside} of {options.studies} bands contain the true force: {100 * part:.1f} % ({'kept' if kept else 'missed'})")


if __name__ == "__main__":
    main()
