"""Prediction of the force of the pulled sheet, with a band.

    python -m validation.kirigami.predict --out out/kirigami
"""

from __future__ import annotations

import argparse
from pathlib import Path

from validation.kirigami.models import MODELS
from validation.kirigami.sheet import curve


def main() -> None:
    """Run the models that have no results yet, and write the prediction."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--only", nargs="*", help="names of models to run; without a prediction")
    arguments = parser.parse_args()
    for name in arguments.only if arguments.only else MODELS:
        found = curve(MODELS[name], arguments.out / name)
        print(
            f"{name}: {found['unknowns']} unknowns, {found['steps']} steps, {found['iterations']} iterations, "
            f"{found['seconds']:.0f} s, {found['force'][-1]:.3f} N at {1e3 * found['extension'][-1]:.1f} mm",
            flush=True,
        )


if __name__ == "__main__":
    main()
