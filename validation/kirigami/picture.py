"""Figures of the pulled sheet: prediction with its band, and the deformed quarter of the sheet.

    python -m validation.kirigami.picture --out out/kirigami
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

import fsm
from validation.kirigami.predict import BEST
from validation.kirigami.sheet import EXTENSION

_SHOWN = (5e-3, 30e-3, 73e-3)
"""Extensions of the drawn shapes, m."""


def draw(folder: Path, file: Path) -> None:
    """Draw the prediction beside it, and views of the quarter from the side of its middle width."""
    rows = np.genfromtxt(file, delimiter=",", names=True)
    solution = fsm.open(folder / BEST).solution
    shapes, travel = np.asarray(solution.shape), np.asarray(solution.travel)[:, 0]
    figure, axes = plt.subplots(1, 4, figsize=(16, 5), gridspec_kw={"width_ratios": [1.6, 1, 1, 1]})
    axes[0].fill_between(rows["extension_mm"], rows["low_N"], rows["high_N"], alpha=0.3, label="band")
    axes[0].plot(rows["extension_mm"], rows["force_N"], label="prediction")
    axes[0].set(xlabel="extension (mm)", ylabel="force (N)", xlim=(0, 1e3 * EXTENSION), ylim=(0, None))
    axes[0].legend()
    for axis, extension in zip(axes[1:], _SHOWN, strict=True):
        triangles = shapes[np.argmin(np.abs(2.0 * travel - extension))][:, :3]
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        order = np.argsort(triangles[:, :, 2].mean(axis=1))  # from below
        tilt = np.degrees(np.arcsin(np.clip(-normal[:, 1], -1.0, 1.0)))
        parts = PolyCollection(list(1e3 * triangles[order][:, :, :2]), array=tilt[order], cmap="coolwarm", edgecolors="face")
        parts.set_clim(-90, 90)
        axis.add_collection(parts)
        axis.autoscale()
        axis.set(aspect="equal", title=f"{1e3 * extension:.0f} mm", xlabel="x (mm)")
    figure.colorbar(parts, ax=axes[3], label="tilt about x (deg)")
    figure.tight_layout()
    figure.savefig(file.with_name("kirigami.png"), dpi=70)


def main() -> None:
    """Draw the figures of complete runs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--file", type=Path, default=Path(__file__).with_name("prediction.csv"), help="prediction")
    arguments = parser.parse_args()
    draw(arguments.out, arguments.file)


if __name__ == "__main__":
    main()
