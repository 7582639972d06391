"""Time and size of a report, and pictures a second of its player, against the number of facets.

    python -m validation.benchmarks.reports [--facets 10,1000,100000] [--records 200]

The structure is a square sheet with a travelling wave. Chromium draws without a graphics card.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fsm.report.write import report_page
from fsm.results.solution import PAIRS, Layout, Record, Solution
from tests.browser import CHROMIUM, Browser

__all__ = ["Measured", "measure", "sheet"]

READY = "document.body && document.body.dataset.ready === 'true'"
PICTURES = """(() => {
    const player = fsmReport.page.player, gl = player.renderer.getContext(), pixel = new Uint8Array(4);
    const wait = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    player.show(0.5); player.render(); wait();
    const begin = performance.now();
    let count = 0;
    while (performance.now() - begin < 3000 && count < 200) {
        player.show((0.37 * ++count) % (player.frames - 1));
        player.render();
        wait();
    }
    return 1000 * count / (performance.now() - begin);
})()"""


class Measured(NamedTuple):
    """Facets, records in the page, time to write (s), size (MB), time to open (s), pictures a second."""

    facets: int
    shown: int
    write: float
    size: float
    opened: float
    rate: float


def sheet(facets: int, records: int) -> Solution:
    """Square sheet of about this number of facets with a travelling wave."""
    n = max(2, round(facets**0.5))
    m = max(2, round(facets / n))
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, m + 1), indexing="ij")
    pairs = {name: np.zeros(0) for name in PAIRS}
    found = []
    for k in range(records):
        z = 0.05 * np.sin(2 * np.pi * (x + 0.5 * y - k / records)) * k / records
        grid = np.stack([x, y, z], axis=-1)
        shape = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2).reshape(-1, 4, 3)
        none = np.zeros(0)
        found.append(Record(0.01 * k, none, none, none, none, {"kinetic": float(k)}, **pairs, shape=shape))
    return Solution.from_records(found, Layout(panel=np.full(n * m, -1), dimension="spatial"))


def measure(browser: Browser, folder: Path, facets: int, records: int) -> Measured:
    """Write the page of a sheet, open it, and play it."""
    run = sheet(facets, records)
    begin = time.perf_counter()
    page = report_page({"sheet": run})
    write = time.perf_counter() - begin
    path = folder / f"{facets}.html"
    path.write_text(page, encoding="utf-8")
    begin = time.perf_counter()
    browser.open(path.as_uri(), READY, 300.0)
    opened = time.perf_counter() - begin
    shown = int(browser.run("fsmReport.page.player.frames"))
    return Measured(run.shape.shape[1], shown, write, path.stat().st_size / 1e6, opened, float(browser.run(PICTURES)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--facets", default="10,1000,20000,100000")
    parser.add_argument("--records", type=int, default=200)
    chosen = parser.parse_args()
    if CHROMIUM is None:
        parser.error("Chromium is not installed")
    print("| facets | shapes in the page | written in (s) | size (MB) | opened in (s) | pictures a second |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder, Browser(Path(folder) / "profile") as browser:
        for facets in map(int, chosen.facets.split(",")):
            found = measure(browser, Path(folder), facets, chosen.records if facets <= 20_000 else min(chosen.records, 40))
            print(
                f"| {found.facets:,} | {found.shown} | {found.write:.1f} | {found.size:.2f} | {found.opened:.1f} "
                f"| {found.rate:.3g} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
