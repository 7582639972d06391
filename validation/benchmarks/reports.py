"""Time and size of a report, and pictures a second of its player, against the number of facets.

    python -m validation.benchmarks.reports [--facets 10,1000,100000] [--panels 144,1296,19600] [--records 200]

The structures are a square film with a travelling wave (`--facets`) and a Miura sheet that folds (`--panels`). Chromium
draws without a graphics card. The rate is one over the median time to draw a picture.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fsm import load
from fsm.builders.patterns.of_sheet import pattern_of
from fsm.results.solution import PAIRS, Layout, Record, Solution
from fsm.views.report.write import report_page
from tests.browser import CHROMIUM, Browser

__all__ = ["Measured", "folded", "measure", "sheet"]

CASE = """
[sheet]
kind = "miura"
columns = {n}
rows = {n}
a = 0.02
b = 0.02
sector_angle = "60 deg"
fold_angle = "15 deg"
thickness = 0.0003

[material]
young = 3e9
density = 1000

[crease]
stiffness_per_length = 0.05

[solve]
end_time = 1.0
"""
READY = "document.body && document.body.dataset.ready === 'true'"
PICTURES = """(() => {
    const player = fsmReport.page.player, gl = player.renderer.getContext(), pixel = new Uint8Array(4);
    const wait = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    player.show(0.5); player.render(); wait();
    const begin = performance.now(), times = [];
    while (performance.now() - begin < 3000 && times.length < 200) {
        const start = performance.now();
        player.show((0.37 * (times.length + 1)) % (player.frames - 1));
        player.render();
        wait();
        times.push(performance.now() - start);
    }
    return 1000 / times.sort((a, b) => a - b)[times.length >> 1];
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


def folded(panels: int, records: int) -> Solution:
    """Square Miura sheet of about this number of rigid panels, which folds."""
    n = max(2, round(panels**0.5))
    text = CASE.format(n=n)
    none, pairs, found = np.zeros(0), {name: np.zeros(0) for name in PAIRS}, []
    sheet = load(text).model.sheet
    for k, angle in enumerate(np.radians(np.linspace(15.0, 55.0, records))):
        pattern = pattern_of(sheet.model_copy(update={"fold_angle": float(angle)}))
        shape = np.asarray(pattern.vertices)[np.asarray(pattern.faces)]
        found.append(Record(0.01 * k, none, none, none, none, {"creases": float(k)}, **pairs, shape=shape))
    return Solution.from_records(found, Layout(case_text=text, panel=np.arange(1, n * n + 1), dimension="spatial"))


def measure(browser: Browser, folder: Path, run: Solution) -> Measured:
    """Write the page of a result, open it, and play it."""
    facets = run.shape.shape[1]
    begin = time.perf_counter()
    page = report_page({"sheet": run})
    write = time.perf_counter() - begin
    path = folder / f"{facets}.html"
    path.write_text(page, encoding="utf-8")
    begin = time.perf_counter()
    browser.open(path.as_uri(), READY, 300.0)
    opened = time.perf_counter() - begin
    shown = int(browser.run("fsmReport.page.player.frames"))
    return Measured(facets, shown, write, path.stat().st_size / 1e6, opened, float(browser.run(PICTURES)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--facets", default="10,1000,20000,100000")
    parser.add_argument("--panels", default="144,1296,4900,19600")
    parser.add_argument("--records", type=int, default=200)
    chosen = parser.parse_args()
    if CHROMIUM is None:
        parser.error("Chromium is not installed")
    print("| structure | facets | shapes in the page | written in (s) | size (MB) | opened in (s) | pictures a second |")
    print("|---|---|---|---|---|---|---|")
    wanted = [("film", sheet, int(text)) for text in chosen.facets.split(",") if text]
    wanted += [("folded sheet", folded, int(text)) for text in chosen.panels.split(",") if text]
    with tempfile.TemporaryDirectory() as folder, Browser(Path(folder) / "profile") as browser:
        for name, make, facets in wanted:
            records = chosen.records if facets <= 20_000 else min(chosen.records, 40)
            found = measure(browser, Path(folder), make(facets, records))
            print(
                f"| {name} | {found.facets:,} | {found.shown} | {found.write:.1f} | {found.size:.2f} | {found.opened:.1f} "
                f"| {found.rate:.3g} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
