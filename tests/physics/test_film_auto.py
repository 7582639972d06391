"""`tension.film = "auto"`: a plain film where it is stretched in all directions, else a tension field."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsm.case.loading.load_case import load_case
from fsm.run.run_case import run_case

FILM = """
analysis = "vibrate"
[membrane]
length = 0.3
width = 0.25
thickness = 12e-6
mesh = [6, 5]
[material]
young = 3e9
poisson = 0.31
density = 1420
[tension]
strain = 1e-3
film = "auto"
[vibration]
modes = 4
"""


@pytest.mark.parametrize(
    ("overrides", "chosen"),
    [
        ((), "plain"),
        (("tension.strain=[1e-3, -2e-4]",), "plain"),  # the strain is less than the contraction across
        (("tension.strain=[1e-3, -6e-4]",), "tension-field"),
        (("tension.strain=none", "tension.pull=2 N"), "tension-field"),
    ],
)
def test_the_choice_and_its_results(tmp_path: Path, overrides: tuple[str, ...], chosen: str) -> None:
    case = tmp_path / "case.toml"
    case.write_text(FILM, encoding="utf-8")
    found, told = (
        run_case(load_case(case, (*overrides, *more)), tmp_path / name, progress=False)
        for name, more in (("auto", ()), ("told", (f"tension.film={chosen}",)))
    )
    assert found["film"] == told["film"] == chosen
    assert found["modes_hz"] == pytest.approx(told["modes_hz"], rel=1e-9)
    assert found["tension_state"]["taut_fraction"] == pytest.approx(told["tension_state"]["taut_fraction"])
    assert (found["tension_state"]["taut_fraction"] == 1.0) == (chosen == "plain")
