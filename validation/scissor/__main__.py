"""Scissor arrays: alpha, the rigid limit, cost; README.md states the purpose of each part.

    python -m validation.scissor [--parts alpha,limit,cost,elements] [--quick] [--out out/scissor]

Exit code 1 means that an error exceeds its tolerance.
"""

from __future__ import annotations

import validation.benchmarks.one_thread  # noqa: F401  isort: skip

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fsm.views.plots.style import WIDE, figure
from validation.scissor.arrays import move, rigid_angle, steel_array

Check = tuple[str, float, float]
"""Quantity, its value, and the largest allowed value."""


def check_alpha(quick: bool, out: Path) -> list[Check]:
    """Three units under a sudden force, 1.2 s, rho_inf from 0 to .99: high frequencies decay, and the displacement stays the
    same."""
    step, end = (5e-4 if quick else 2.5e-4), 1.2
    rhos = (0.99, 0.9, 0.6, 0.0)
    runs = {rho: move(steel_array(3, 0.0), end, step, round(end / step), rho) for rho in rhos}
    places = {rho: run.place("a1", 1) for rho, run in runs.items()}
    accelerations = {rho: run.acceleration("a1", 1) for rho, run in runs.items()}
    travelled = abs(places[0.99][-1] - places[0.99][0])
    high = {}
    say("| rho_inf | acceleration of a1 above 400 Hz, rms m/s2 | largest change of its displacement, part of the travel |")
    for rho in rhos:
        begin = round(0.1 / step)  # the shock of the sudden force has ended by then
        spectrum = np.fft.rfft(accelerations[rho][begin:])
        spectrum[np.fft.rfftfreq(len(accelerations[rho][begin:]), step) < 400.0] = 0.0
        high[rho] = float(np.sqrt(np.mean(np.fft.irfft(spectrum) ** 2)))
        change = float(np.abs(places[rho] - places[0.99]).max() / travelled)
        say(f"| {rho:.2f} | {high[rho]:.4g} | {change:.2e} |")
    with figure(out / "alpha.png", (WIDE[0], 6.4)) as fig:
        *above, below = fig.subplots(4, 1, sharex=True)
        for ax, rho in zip(above, (0.99, 0.9, 0.6), strict=True):
            ax.plot(runs[rho].times, accelerations[rho], lw=0.5)
            ax.set_title(f"rho_inf = {rho:g}", loc="left")
        for rho in (0.99, 0.9, 0.6):
            below.plot(runs[rho].times, places[rho] - places[rho][0], lw=1.0, label=f"rho_inf = {rho:g}")
        above[1].set_ylabel("acceleration of a1 along y (m/s$^2$)")
        above[2].set_ylim(-30.0, 30.0)
        below.set(xlabel="time (s)", ylabel="displacement (m)")
        below.legend()
    worst = max(float(np.abs(places[rho] - places[0.99]).max() / travelled) for rho in rhos)
    return [
        ("alpha: high frequencies at .9 over those at .99", high[0.9] / high[0.99], 0.5),
        ("alpha: high frequencies at .6 over those at .9", high[0.6] / high[0.9], 0.5),
        ("alpha: change of the displacement", worst, 1e-3),
    ]


def check_limit(quick: bool, out: Path) -> list[Check]:
    """Three units under a force that increases slowly: the difference from rigid bars is proportional to 1/E."""
    ramp, end = 0.2, 0.8
    factors = (4.0, 16.0, 64.0) if quick else (1.0, 4.0, 16.0, 64.0, 256.0)
    errors = []
    for factor in factors:
        run = move(steel_array(3, ramp, 2, stiffer=factor), end, 2e-4, 40)
        exact = 3.0 * np.cos(rigid_angle(3, run.times, ramp))
        after = run.times > ramp
        errors.append(float(np.sqrt(np.mean((run.place("b4", 0) - exact)[after] ** 2))))
    orders = np.log(np.array(errors[:-1]) / errors[1:]) / np.log(np.array(factors[1:]) / factors[:-1])
    say("| E over steel's | rms difference of b4 from rigid bars, mm | order |")
    for factor, error, order in zip(factors, errors, [float("nan"), *orders], strict=True):
        say(f"| {factor:g} | {1e3 * error:.4g} | {order:.3f} |")
    with figure(out / "rigid_limit.png") as fig:
        ax = fig.subplots()
        ax.loglog(factors, 1e3 * np.array(errors), "o-")
        ax.loglog(factors, 1e3 * errors[0] * factors[0] / np.array(factors), "--", label="1/E")
        ax.set_xticks(factors, [f"{factor:g}" for factor in factors])
        ax.minorticks_off()
        ax.set(xlabel="E over that of steel", ylabel="difference from rigid bars (mm)")
        ax.legend()
    return [("limit: order in 1/E is off 1 by", float(np.abs(orders[-2:] - 1.0).max()), 0.15)]


def check_cost(quick: bool, out: Path) -> list[Check]:
    """Time of a step against the number of units, and of three units for 1.5 s."""
    counts = (3, 10, 30) if quick else (3, 10, 30, 100, 300)
    times = []
    say("| units | coordinates | ms a step |")
    for units in counts:
        system = steel_array(units, 0.02)
        move(system, 0.005, 5e-4, 1)
        steps = 60
        found = [move(system, steps * 5e-4, 5e-4, 1).wall / steps for _ in range(3)]
        times.append(float(np.median(found)))
        say(f"| {units} | {system.nu} | {1e3 * times[-1]:.3f} |")
    exponent = float(np.polyfit(np.log(counts), np.log(times), 1)[0])
    last = float(np.log(times[-1] / times[-2]) / np.log(counts[-1] / counts[-2]))
    walls = [move(steel_array(3, 0.02), 1.5, 5e-4, 300).wall for _ in range(1 if quick else 5)]
    say(f"exponent {exponent:.3f} over all, {last:.3f} at the end")
    say(f"1.5 s of three units, 3000 steps: {np.median(walls):.2f} s warm")
    with figure(out / "cost.png") as fig:
        ax = fig.subplots()
        ax.loglog(counts, 1e3 * np.array(times), "o-")
        ax.set(xlabel="units", ylabel="time of a step (ms)")
    return [
        ("cost: exponent in the number of units", exponent, 1.15),
        ("cost: exponent at the end", last, 1.15),
        ("cost: three units for 1.5 s, s (on this machine)", float(np.median(walls)), 3.0),
    ]


def check_elements(quick: bool, out: Path) -> list[Check]:
    """The three kinds of elements with several numbers of elements per bar, compared with eight "section" elements per
    bar."""
    end, step = 1.2, 2.5e-4  # it takes 15 s, with and without --quick
    best = move(steel_array(3, 0.02, 8), end, step, 60)
    travel = best.place("b4", 0)[-1] - best.place("b4", 0)[0]
    found = []
    say("| element | a bar | largest difference of b4, part of its travel | energy error | s |")
    for element in ("section", "green", "cable"):
        for count in (2, 4):
            run = move(steel_array(3, 0.02, count, element), end, step, 60)
            off = float(np.abs(run.place("b4", 0) - best.place("b4", 0)).max() / travel)
            say(f"| {element} | {count} | {off:.2e} | {run.energy_balance.relative_error:.1e} | {run.wall:.2f} |")
            found.append((f"elements: {element}, {count} a bar", off, 1e-3 if count == 2 else 1e-4))
    found.append(("elements: energy error of the best", best.energy_balance.relative_error, 1e-5))
    return found


PARTS = {"alpha": check_alpha, "limit": check_limit, "cost": check_cost, "elements": check_elements}


def say(text: str) -> None:
    """Print at once."""
    print(text, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m validation.scissor")
    parser.add_argument("--parts", default=",".join(PARTS))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("out/scissor"))
    chosen = parser.parse_args(arguments)
    failed = 0
    for name in chosen.parts.split(","):
        for what, value, allowed in PARTS[name](chosen.quick, chosen.out):
            good = value <= allowed
            failed += not good
            say(f"{'ok  ' if good else 'OFF '} {what}: {value:.4g} (at most {allowed:g})")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
