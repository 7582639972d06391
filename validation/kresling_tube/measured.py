"""First compressions of twelve printed tubes, read at a few travels.

    python -m validation.kresling_tube.measured FOLDER

FOLDER has the files kresling_L0.69_FS_A.csv ... of the directory Kresling_Analysis of the public repository
PARSES-Lab/kresling-structure (commit 547b5cb). The repository has no licence, so no file of it is here. Other commands read
the folder that the environment variable FSM_KRESLING_TESTS names.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from functools import cache
from pathlib import Path

import numpy as np

__all__ = ["RATIOS", "SPECIMENS", "compressions", "first_compression", "tests_folder"]

FOLDER = "FSM_KRESLING_TESTS"
"""Environment variable with the folder of the raw tests."""
RATIOS = (0.69, 0.75, 0.85)
SPECIMENS = {
    0.69: ("FS_A", "FS_B", "SF_C", "SF_D"),
    0.75: ("FS_A", "FS_B", "SF_C", "SF_D"),
    0.85: ("FS_C", "FS_D", "SF_E", "SF_F"),
}
TRAVELS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 18.0, 21.0)
"""mm."""
_WEIGHT = 1.32435
"""N; a block of 135 g lies on the tube. The evaluation in the repository adds it, too."""
_AVERAGE = 0.2
"""mm; forces are means of the rows up to this distance from a travel."""


def tests_folder() -> Path | None:
    """Folder of the raw tests; None if the environment variable is not set."""
    name = os.environ.get(FOLDER, "")
    return Path(name) if name else None


@cache
def compressions(ratio: float, folder: Path | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Travels (n,), m, and forces of the four tubes of a ratio (4, n), N, from a folder or the one of the environment.

    Raises
    ------
    FileNotFoundError
    """
    folder = folder or tests_folder()
    if folder is None:
        raise FileNotFoundError(f"the tests are not here: set {FOLDER} to the folder of the raw tests (see README.md)")
    curves = [first_compression(folder / f"kresling_L{ratio}_{name}.csv") for name in SPECIMENS[ratio]]
    forces = [[force[np.abs(travel - at) < _AVERAGE].mean() for at in TRAVELS] for travel, force in curves]
    return 1e-3 * np.array(TRAVELS), np.array(forces)


def first_compression(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Travel, mm, and force, N, of the first compression in a file of the repository."""
    rows = []
    with path.open(encoding="utf-8") as file:
        for row in csv.reader(file):
            try:
                rows.append((-float(row[1]), _WEIGHT - float(row[0])))
            except (ValueError, IndexError):
                continue
    travel, force = np.array(rows).T
    end = int(np.argmax(travel > travel.max() - 0.02)) + 1
    return travel[:end], force[:end]


def main() -> int:
    """Print travel and forces of all tubes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    for ratio in RATIOS:
        for at, forces in zip(TRAVELS, compressions(ratio, folder)[1].T, strict=True):
            print(f"{ratio},{at:g}," + ",".join(f"{value:.1f}" for value in forces))
    return 0


if __name__ == "__main__":
    sys.exit(main())
