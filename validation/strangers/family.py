"""A family of creases, calibrated from a table of bench tests as a user would; the tests are synthetic and free of noise."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from click.testing import CliRunner

from fsm.cli.command_line import cli
from validation.strangers.sheets import FAMILY_FILE, FAMILY_STIFFNESS

__all__ = ["crease_family"]


def crease_family(folder: Path) -> Path:
    """File of the family, which `fsm calibrate crease` makes unless it exists.

    Creases that are pressed longer are up to 20 % stiffer, every opening reduces the stiffness by 8 %, and all soften as
    they open: M = k o/(1 + o/1.2).
    """
    made = folder / FAMILY_FILE
    if made.is_file():
        return made
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["press_time [s], opening [-], angle [deg], moment [N mm]"]
    for press, gain in ((60.0, 0.8), (600.0, 0.9), (3600.0, 1.0)):
        for opening in (1, 2, 3):
            for angle in np.linspace(0.0, 178.0, 40):
                turn = math.radians(angle)
                moment = 1e3 * FAMILY_STIFFNESS * gain * 0.92 ** (opening - 1) * turn / (1.0 + turn / 1.2)
                lines.append(f"{press:g}, {opening}, {angle:.2f}, {moment:.5g}")
    data = folder / "creases.csv"
    data.write_text("\n".join(lines) + "\n", encoding="utf-8")
    call = ["calibrate", "crease", str(data), "--fit", "interpolate", "--out", str(folder), "--quiet"]
    result = CliRunner().invoke(cli, call)
    if result.exit_code or not made.is_file():
        raise RuntimeError(f"fsm {' '.join(call)}: exit code {result.exit_code}: {result.output}")
    return made
