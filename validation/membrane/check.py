"""The tensioned membrane against exact solutions, closed forms and itself.

    python -m validation.membrane.check [--parts frequencies precision energy speed strip] [--quick]

Prints what it finds; exit code 1 if something is outside its limits. `strip` takes
some minutes; `--quick` takes a short one.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fsm.ancf.wrinkle import strip_wrinkles
from fsm.solve.modal import modes
from fsm.solve.newton import equilibrium
from fsm.solve.simulate import Saved, Settings, simulate
from validation.benchmarks.demo import machine
from validation.membrane.film import AMPLITUDE, exact_frequencies, frequency, plucked_film, pulled_film, tensioned_film
from validation.membrane.strip import FILM, HEIGHT, SHEAR, Wrinkled, wrinkled_strip


def frequencies(quick: bool) -> bool:
    """The six lowest of the tensioned square against the exact ones, and the order of convergence."""
    errors = {}
    for n in (6, 12) if quick else (6, 12, 24):
        system, _ = tensioned_film(n)
        found = modes(system, 0.0, system.start, 6).frequencies
        errors[n] = found / exact_frequencies(6) - 1.0
        line = " ".join(f"{f:9.4f}" for f in found)
        print(f"{n:3} x {n:<3} {line}  largest error {np.abs(errors[n]).max():.1e}")
    print("exact     " + " ".join(f"{f:9.4f}" for f in exact_frequencies(6)))
    order = np.log2(np.abs(errors[6] / errors[12]))
    print("order 6 to 12: " + " ".join(f"{o:.2f}" for o in order))
    return bool(np.abs(errors[12]).max() < 5e-3)


def _vibration(n: int, settings: Settings, every: float) -> tuple[float, float, float]:
    """Frequency (Hz), energy error and processor's seconds of a second of simulated time."""
    system, height = plucked_film(n)
    states: list[Saved] = []
    begun = time.thread_time()
    _, ledger = simulate(system, settings, np.arange(0.0, settings.end_time * (1 + 1e-9), every), states.append)
    seconds = (time.thread_time() - begun) / settings.end_time
    found = frequency(np.array([s.time for s in states]), np.array([s.q[height] for s in states]))
    return found, ledger.relative_error, seconds


def precision(quick: bool) -> bool:
    """Frequency of the free vibration at an amplitude of 20 thicknesses against mesh, step and method."""
    duration, every = 0.1, 5e-4
    reference, _, _ = _vibration(12, Settings("Radau-blocks", 1e-5, duration), every)
    print(f"amplitude {1e3 * AMPLITUDE:g} mm, 12 x 12, Radau at rtol 1e-5: {reference:.4f} Hz")
    good = True
    for n in (4, 8, 12):
        for method, rtol, step in (
            ("generalized-alpha", 1e-3, 1e-3), ("generalized-alpha", 1e-3, 5e-4), ("generalized-alpha", 1e-3, 2.5e-4),
            ("generalized-alpha", 1e-3, 1.25e-4), ("Radau-blocks", 1e-3, None), ("Radau-blocks", 1e-4, None),
        ):  # fmt: skip
            if quick and n > 4:
                continue
            settings = Settings(method, rtol, duration, rho_inf=0.9, step=step)
            found, energy, seconds = _vibration(n, settings, step or every)
            error = found / reference - 1.0
            how = f"h = {1e3 * step:g} ms" if step else f"rtol {rtol:g}"
            print(f"{n:3} x {n:<3} {method:18} {how:14} {error:10.2e} energy {energy:8.1e} {seconds:8.2f} s a second")
            good &= abs(error) < 1e-3 or method == "generalized-alpha"
    return good


def energy(quick: bool) -> bool:
    """Balance of an undamped free vibration of 0.2 s."""
    system, _ = plucked_film(4 if quick else 6, 2e-4)
    _, ledger = simulate(system, Settings("Radau-blocks", 1e-7, 0.2), [0.2], lambda saved: None)
    print(f"energy balance of 0.2 s of free vibration: {ledger.relative_error:.1e} of the energy turned over")
    return ledger.relative_error < 1e-6


def _timed(run: Callable[[], Any], repeat: int) -> str:
    run()
    wall, processor = [], []
    for _ in range(repeat):
        begun = time.perf_counter(), time.thread_time()
        run()
        wall.append(time.perf_counter() - begun[0])
        processor.append(time.thread_time() - begun[1])
    return f"{statistics.median(wall):9.4f} s wall {statistics.median(processor):9.4f} s processor"


def speed(quick: bool) -> bool:
    """Medians, warm, one thread."""
    print(machine())
    for n in (12,) if quick else (12, 40):
        pulled, _, _ = pulled_film(n)
        repeat = 5 if n == 12 else 3
        taken = _timed(lambda p=pulled: equilibrium(p, p.start, np.array([0.0, 1.0])), repeat)
        print(f"{n} x {n} prestress         {taken}")
        system, _ = tensioned_film(n)
        print(f"{n} x {n} 20 modes          " + _timed(lambda s=system: modes(s, 0.0, s.start, 20), repeat))
        shaken = system.start + 1e-4 * np.random.default_rng(0).normal(size=system.nq) * ~system.fixed
        print(f"{n} x {n} force             " + _timed(lambda s=system, q=shaken: s.force(0.0, q, None), 25))
        print(f"{n} x {n} force and tangent " + _timed(lambda s=system, q=shaken: s.linearise(0.0, q, None), 25))
    return True


def strip(quick: bool) -> bool:
    """Wrinkles of the sheared strip, resolved, against the closed form and the tension field."""
    closed = strip_wrinkles(HEIGHT, FILM.thickness, FILM.poisson, SHEAR / HEIGHT)
    starts = ((0.128, 0.8), (0.128, 1.0), (0.384, 0.782), (0.384, 0.8))
    cases = [(length, 0.004, start) for length, start in (starts[:1] if quick else starts)]
    print(f"closed form: half-wavelength {1e3 * closed.half_wavelength:.3f} mm, amplitude {1e3 * closed.amplitude:.4f} mm")
    best: dict[float, Wrinkled] = {}
    for length, cell, seed in cases:
        found = wrinkled_strip(length, cell, seed)
        if length not in best or found.energy < best[length].energy:
            best[length] = found
        off = found.half_wavelength / closed.half_wavelength - 1, found.amplitude / closed.amplitude - 1
        stress = found.tension_field / found.resolved - 1
        print(
            f"length {1e3 * length:g} mm, cells {1e3 * cell:g} mm, start {seed:g}: half-wavelength "
            f"{1e3 * found.half_wavelength:.3f} mm ({off[0]:+.1%}), amplitude {1e3 * found.amplitude:.4f} mm "
            f"({off[1]:+.1%}); stress {1e-6 * found.resolved:.3f} and {1e-6 * found.smaller:.3f} MPa, tension field "
            f"{1e-6 * found.tension_field:.3f} MPa ({stress:+.1%}); {1e3 * found.energy:.5f} mJ; "
            f"{found.iterations} iterations, {found.seconds:.0f} s"
        )
    good = True
    for length, found in best.items():
        good &= abs(found.half_wavelength / closed.half_wavelength - 1) < 0.15
        good &= abs(found.tension_field / found.resolved - 1) < 0.02
        if length > 2 * HEIGHT:  # in a short strip the free edges give way, and wrinkles are higher
            good &= abs(found.amplitude / closed.amplitude - 1) < 0.15
    return good


PARTS = {
    "frequencies": frequencies, "precision": precision, "energy": energy, "speed": speed, "strip": strip,
}  # fmt: skip


def main() -> int:
    """All parts asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=list(PARTS), default=list(PARTS))
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    bad = []
    for name in options.parts:
        print(f"\n{name}: {PARTS[name].__doc__}")
        if not PARTS[name](options.quick):
            bad.append(name)
    print("\noutside their limits: " + (", ".join(bad) or "none"))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
