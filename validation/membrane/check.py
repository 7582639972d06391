"""The tensioned membrane against exact solutions, closed forms and itself.

    python -m validation.membrane.check [--parts frequencies precision energy strip] [--full]

Exit code 1 means that a result is outside its tolerance. --full adds 24 x 24 cells, all meshes of `precision` and the long
strip, which take some minutes each. `python -m validation.membrane.speed` measures the times.
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import astuple, fields
from pathlib import Path

import numpy as np

from fsm.model.nodes.films.wrinkle import strip_wrinkles
from fsm.solve.modal import modes
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.gallery.command import command
from validation.gallery.drawing import bars, beside, convergence
from validation.gallery.record import Check, Part, Place, against, below
from validation.membrane.film import AMPLITUDE, exact_frequencies, frequency, plucked_film, tensioned_film
from validation.membrane.strip import FILM, HEIGHT, SHEAR, Wrinkled, wrinkled_strip

STARTS = (0.78, 1.0)
"""Initial half-wavelengths of the long strip over the closed form: the two of six with the least energy."""
EXACT = "closed form of the hinged plate under tension, ω² = (Dk⁴ + Nk²)/(ρt), in material lengths"


def frequencies(place: Place) -> Iterator[Check]:
    """The six lowest frequencies of the tensioned square compared with the exact ones, and the order of convergence."""
    counts = (4, 6, 8, 12, 24) if place.full else (4, 6, 8, 12)
    exact = exact_frequencies(6)
    found = {}
    for n in counts:
        system, _ = tensioned_film(n)
        found[n] = modes(system, 0.0, system.start, 6).frequencies
    errors = {f"mode {i + 1}": [float(abs(found[n][i] / exact[i] - 1)) for n in counts] for i in (0, 1, 3, 4)}
    picture = convergence(place.out / "order.png", counts, errors, 5, x="cells along a side")
    for i, (value, number) in enumerate(zip(found[12], exact, strict=True)):
        yield against(
            f"f{i + 1}, 12 x 12 cells",
            "300 x 300 x .025 mm, edges moved out by 1e-3",
            float(value),
            float(number),
            EXACT,
            picture,
            rtol=2e-5,
            unit="Hz",
        )
    order = np.log2(np.abs((found[6] / exact - 1) / (found[12] / exact - 1)))
    yield below(
        "order of convergence: below 5 by",
        "6 to 12 cells, worst of six modes",
        float(max(0.0, 5.0 - order.min())),
        0.0,
        "slopes held along the edges",
        picture,
        detail="orders " + " ".join(f"{o:.2f}" for o in order),
    )


def _vibration(n: int, settings: Settings, every: float) -> tuple[float, float, float]:
    """Frequency (Hz), energy error, and processor time (s) for one second of simulated time."""
    system, height = plucked_film(n)
    states: list[SavedState] = []
    begun = time.thread_time()
    _, energy_balance = simulate(system, settings, np.arange(0.0, settings.end_time * (1 + 1e-9), every), states.append)
    seconds = (time.thread_time() - begun) / settings.end_time
    found = frequency(np.array([s.time for s in states]), np.array([s.q[height] for s in states]))
    return found, energy_balance.relative_error, seconds


def precision(place: Place) -> Iterator[Check]:
    """Frequency of the free vibration at an amplitude of 20 thicknesses for different meshes, steps and methods."""
    duration, every = 0.1, 5e-4
    reference, _, _ = _vibration(12 if place.full else 8, Settings("Radau-blocks", 1e-5, duration), every)
    steps = (1e-3, 5e-4, 2.5e-4, 1.25e-4)
    picture, lines = place.out / "precision.png", {}
    for n in (4, 8, 12) if place.full else (4,):
        errors = []
        for step in steps:
            value, energy, seconds = _vibration(
                n, Settings("generalized-alpha", 1e-3, duration, rho_inf=0.9, step=step), step
            )
            errors.append(abs(value / reference - 1))
        lines[f"{n} x {n}, generalized-alpha"] = errors
        order = float(np.log2(errors[0] / errors[2]) / 2)
        yield below(
            f"{n} x {n}: order of generalized-alpha in the step, off 2 by",
            "steps of 1 to .25 ms",
            abs(order - 2),
            0.2,
            "second order",
            picture,
            detail=", ".join(f"{1e3 * h:g} ms {e:.1e}" for h, e in zip(steps, errors, strict=True)),
        )
        for rtol in (1e-3, 1e-4):
            value, energy, seconds = _vibration(n, Settings("Radau-blocks", rtol, duration), every)
            detail = f"energy {energy:.1e}, {seconds:.1f} s a second"
            yield against(
                f"{n} x {n}: Radau at rtol {rtol:g}",
                f"amplitude {1e3 * AMPLITUDE:g} mm",
                value,
                reference,
                f"{'12 x 12' if place.full else '8 x 8'}, Radau at rtol 1e-5",
                picture,
                rtol=1e-3,
                unit="Hz",
                detail=detail,
            )
    convergence(picture, [1.0 / step for step in steps], lines, 2, x="steps a second", y="relative error of the frequency")


def energy(place: Place) -> Iterator[Check]:
    """Energy balance of an undamped free vibration of 0.2 s."""
    system, height = plucked_film(6 if place.full else 4, 2e-4)
    states: list[SavedState] = []
    _, energy_balance = simulate(system, Settings("Radau-blocks", 1e-7, 0.2), np.linspace(0.0, 0.2, 401), states.append)
    shown = {"centre": ([s.time for s in states], [1e3 * s.q[height] for s in states])}
    picture = beside(place.out / "vibration.png", shown, {}, "time (s)", "height of the centre (mm)", size=(6.0, 3.0))
    yield below(
        "energy error",
        "0.2 s of free vibration, of the reference energy",
        energy_balance.relative_error,
        1e-6,
        "conservation of energy",
        picture,
    )


def strip(place: Place) -> Iterator[Check]:
    """Wrinkles of the sheared strip that the mesh resolves, compared with the closed form and the tension field."""
    closed = strip_wrinkles(HEIGHT, FILM.thickness, FILM.poisson, SHEAR / HEIGHT)
    source = "closed form of the sheared strip (docs/theory.md), half-wavelength √(πHt)/[3(1-ν²)γ]^¼"
    picture = place.out / "strip.png"
    yield against(
        "half-wavelength of the closed form",
        "H = 128 mm, t = 25 µm, ν = .31, 1 mm",
        1e3 * closed.half_wavelength,
        8.311,
        "validation/references.md",
        picture,
        rtol=1e-4,
        unit="mm",
    )
    yield against(
        "amplitude of the closed form",
        "the same",
        1e3 * closed.amplitude,
        0.2747,
        "validation/references.md",
        picture,
        rtol=3e-4,
        unit="mm",
    )
    starts = ((0.128, 0.8), *((0.384, start) for start in STARTS)) if place.full else ((0.128, 0.8),)
    best: dict[float, Wrinkled] = {}
    all_found = []
    for length, seed in starts:
        found = wrinkled_strip(length, 0.004, seed)
        all_found.append((f"{1e3 * length:g} mm\nstart {seed:g}", found))
        if length not in best or found.energy < best[length].energy:
            best[length] = found
    _listed(place.out / "strip.csv", starts, [found for _, found in all_found])
    for length, found in best.items():
        name = f"strip of {1e3 * length:g} mm"
        told = (
            f"{1e3 * found.energy:.5f} mJ, {found.iterations} iterations, {found.seconds:.0f} s; smaller "
            f"stress {1e-6 * found.smaller:.2f} MPa"
        )
        yield against(
            f"{name}: half-wavelength",
            "4 mm cells, resolved",
            1e3 * found.half_wavelength,
            1e3 * closed.half_wavelength,
            source,
            picture,
            rtol=0.15,
            unit="mm",
            detail=f"{told}; the closed form is for an infinite strip, judged is the stable shape of least energy",
        )
        yield against(
            f"{name}: mean stress of the tension field",
            "against wrinkles that are resolved",
            1e-6 * found.tension_field,
            1e-6 * found.resolved,
            "wrinkles resolved by the mesh",
            picture,
            rtol=0.02,
            unit="MPa",
        )
        if length > 2 * HEIGHT:  # in a short strip the free edges yield, and wrinkles are higher
            yield against(
                f"{name}: amplitude",
                "4 mm cells, resolved",
                1e3 * found.amplitude,
                1e3 * closed.amplitude,
                source,
                picture,
                rtol=0.15,
                unit="mm",
                detail="the closed form is for an infinite strip, judged is the stable shape of least energy",
            )
    names = [name for name, _ in all_found]
    bars(
        picture,
        names,
        [1e3 * f.half_wavelength for _, f in all_found],
        [1e3 * closed.half_wavelength] * len(names),
        "half-wavelength (mm)",
        "sheared strip",
    )


def _listed(path: Path, starts: Sequence[tuple[float, float]], shapes: Sequence[Wrinkled]) -> None:
    """All stable shapes that were found, in one row each."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["length (m)", "start", *(field.name for field in fields(Wrinkled))])
        rows.writerows([*start, *astuple(shape)] for start, shape in zip(starts, shapes, strict=True))


TITLE = "The tensioned membrane"
PARTS: dict[str, Part] = {"frequencies": frequencies, "precision": precision, "energy": energy, "strip": strip}

if __name__ == "__main__":
    sys.exit(command(PARTS, "membrane", __doc__))
