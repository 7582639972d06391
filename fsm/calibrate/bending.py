"""Bending stiffness EI of the plain panel from a cantilever test, by inverse simulation with the segment model.

A strip of free length L is clamped at one end. A transverse force F of constant direction deflects the other end by w
(Li and Huang 2025). The joint springs of the segment model are proportional to EI, so for all sizes

    w/L = g(F L^2/EI) .

The function g is computed once with the segment model, for large deflections too. The slope follows from implicit
differentiation of the equilibrium, K dq/dF = dh/dF. EI is fitted by least squares.
The small-angle formula EI = F L^3/(3 w) is evaluated for comparison.

The data have the columns `force`, `deflection` and `length` (free length), and optionally `width`, `thickness`, `segments`
and `repeat`. The TOML file of the same name may contain constant quantities instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import least_squares

from fsm.calibrate.data import MeasuredTable, read_table
from fsm.calibrate.report import Calibration, Options, Quantity
from fsm.calibrate.uncertainty import Estimate, bootstrap, from_samples, laplace
from fsm.case.models.loads import Load
from fsm.case.models.scene import GROUND, Body, ForceElement, Scene
from fsm.case.models.time_program import Table as TimeTable
from fsm.errors import CaseError, Fault
from fsm.kernels import jit
from fsm.model.compile.compile import compile_scene
from fsm.run.progress import Progress
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import equilibrium
from fsm.views.plots.calibration import FitPlot, plot_fit

QUANTITIES = {
    "force": "force",
    "deflection": "length",
    "length": "length",
    "width": "length",
    "thickness": "length",
    "segments": "number",
    "repeat": "number",
}
SEGMENTS = 160
"""Segments of the simulated cantilever; the error of EI is 2e-5 to 2e-4 at deflections of 30 to 81 % of the length."""
DEFAULT_SEGMENTS = 20
"""Segments per length for the reported joint stiffness, unless the data give another number."""
MIN_REPEATS = 3
"""Fewest repeats for an interval from the differences between repeats."""
_INEXTENSIBLE = 1e8
"""Axial and shear stiffness of a panel whose thickness is not given, relative to EI/L^2."""
_MAX_DEFLECTION = 0.95
"""Largest admissible ratio of deflection to length."""
_STEP = 0.25
"""Largest step of the load F L^2/EI, up to loads of 2.5; larger loads grow by a tenth per step."""
_DRAWS = 400
"""Bootstrap samples."""
_OFFSET_ERRORS = 3.0
"""Deflection at zero force, in standard errors, above which a warning is given."""
_SMALL_ANGLE = 0.1
"""Ratio of deflection to length up to which the error of the small-angle formula is below 0.5 %."""


@dataclass(frozen=True)
class _Test:
    """Data of a test: forces (N), deflections (m), repeats, free length (m), width and thickness (m) if given, segments."""

    force: np.ndarray
    deflection: np.ndarray
    repeat: np.ndarray
    length: float
    width: float | None
    thickness: float | None
    segments: int


def calibrate_bending(data: Path, options: Options) -> Calibration:
    """Fit EI to a cantilever test.

    Raises
    ------
    CaseError
        The data have faults; all are listed.
    """
    table = read_table(data, QUANTITIES, ["force", "deflection", "length"])
    faults = _faults(table)
    if faults:
        raise CaseError(faults, str(data))
    test = _test(table)
    slenderness = None if test.thickness is None else test.length / test.thickness
    with Progress(options.progress, 1.0, "cantilever", jit) as progress:
        curve = cantilever_curve(float(np.abs(test.deflection).max()) / test.length, slenderness)
        progress.step(1.0, len(curve.x))
    estimate = _estimate(test, curve, options)
    small = _small_angle(test)
    return Calibration(
        kind="bending",
        sources=(data,),
        quantities=_quantities(test, estimate, small, options),
        numbers=_numbers(test, estimate, small),
        lines=_lines(test),
        warnings=_warnings(table, test, curve, estimate),
        plots=[("bending.png", partial(plot_fit, _plot(test, curve, estimate, small, options)))],
    )


# the segment model ---------------------------------------------------------------------------------------------------


def cantilever_curve(deflection: float, slenderness: float | None = None) -> CubicHermiteSpline:
    """Tip deflection over length, g, as a function of F L^2/EI, from 0 to beyond the given deflection.

    Parameters
    ----------
    deflection : -
        Deflection over length, at most 0.95.
    slenderness : -
        Length over thickness, for axial and shear deformation (nu = 0.3); None neglects both.
    """
    scene = _cantilever(SEGMENTS, _INEXTENSIBLE if slenderness is None else 12.0 * slenderness**2)
    system = compile_scene(scene)
    solver = LinearSolver()
    tip = np.zeros(system.nu)
    tip[-2] = 1.0
    loads, tips, slopes = [0.0], [0.0], []
    q, _ = system.initial()

    def slope(load: float, at: np.ndarray) -> float:
        solver.factorise(system.linearise(load, at, None).stiffness)
        # the relation is exact, because it is linear in the load
        change = system.force(load + 1.0, at, None) - system.force(load, at, None)
        moved = solver.solve(change)
        return float(moved[-2] - 0.5 / SEGMENTS * math.cos(at[-1]) * moved[-1])

    slopes.append(slope(0.0, q))
    while tips[-1] < deflection or len(loads) < 3:
        load = loads[-1] + max(_STEP, 0.1 * loads[-1])
        q = equilibrium(system, q, np.array([loads[-1], load]))
        loads.append(load)
        tips.append(float(q[-2] - 0.5 / SEGMENTS * math.sin(q[-1])))
        slopes.append(slope(load, q))
    return CubicHermiteSpline(loads, tips, slopes)


def _cantilever(count: int, stretch: float) -> Scene:
    """Cantilever with L = EI = 1 along x and half a cell at the clamp; a dead force acts along z, and its size equals the
    time.
    """
    length = 1.0 / count
    bodies = tuple(
        Body(name=f"segment {i + 1}", mass=1.0, inertia=(1.0,) * 3, position=((i + 0.5) * length, 0.0, 0.0))
        for i in range(count)
    )
    shear = 5.0 / 6.0 * stretch / (2.0 * 1.3) if stretch < _INEXTENSIBLE else stretch
    elements = []
    for i in range(count):
        flexible = length if i else length / 2
        elements.append(
            ForceElement(
                name=f"joint {i}",
                inner=f"segment {i}" if i else GROUND,
                outer=f"segment {i + 1}",
                point_inner=(length / 2 if i else 0.0, 0.0, 0.0),
                point_outer=(-length / 2, 0.0, 0.0),
                translation=(stretch / flexible, shear / flexible, shear / flexible),
                rotation=(1.0 / flexible,) * 3,
            )
        )
    largest = 1e6
    load = Load(
        body=f"segment {count}",
        point=(length / 2, 0.0, 0.0),
        force=(0.0, 0.0, 1.0),
        time=TimeTable(kind="table", time=(0.0, largest), value=(0.0, largest)),
    )
    return Scene(bodies=bodies, elements=tuple(elements), loads=(load,))


def fit_rigidity(force: np.ndarray, deflection: np.ndarray, length: float, curve: CubicHermiteSpline) -> float:
    """Bending stiffness EI, N m^2, by least squares of the deflections (m) under forces (N)."""
    start = force @ force * length**3 / (3.0 * (force @ deflection))  # small-angle formula

    def residual(p: np.ndarray) -> np.ndarray:
        return _model_deflection(force, length, math.exp(p[0]), curve)[0] - deflection / length

    def gradient(p: np.ndarray) -> np.ndarray:
        return _model_deflection(force, length, math.exp(p[0]), curve)[1][:, None]

    return math.exp(least_squares(residual, [math.log(start)], jac=gradient, xtol=1e-14, ftol=1e-14, gtol=1e-14).x[0])


def _model_deflection(
    force: np.ndarray, length: float, rigidity: float, curve: CubicHermiteSpline
) -> tuple[np.ndarray, np.ndarray]:
    """Deflection over length, w/L, of the model and its derivative with respect to log EI."""
    load = force * length**2 / rigidity
    # the curve is odd; only the search needs its linear extrapolation
    size, last = np.abs(load), float(curve.x[-1])
    inside = np.minimum(size, last)
    slope = curve(inside, 1)
    value = curve(inside) + slope * (size - inside)
    return np.sign(load) * value, -slope * size * np.sign(load)


# data ----------------------------------------------------------------------------------------------------------------


def _faults(table: MeasuredTable) -> list[Fault]:
    columns, faults = table.columns, []
    for name in ("length", "width", "thickness", "segments"):
        if name not in columns:
            continue
        values = columns[name]
        bad = np.flatnonzero(values <= 0.0)
        if len(bad):
            faults.append(table.fault(int(bad[0]), f"{name} is {table.shown(name, int(bad[0]))}; it must be greater than 0"))
        elif np.ptp(values) > 1e-9 * values[0]:
            other = int(np.argmax(values != values[0]))
            what = f"{name} is {table.shown(name, other)} after {table.shown(name, 0)}; give each panel its own file"
            faults.append(table.fault(other, what))
    if faults:
        return faults
    force, deflection, length = columns["force"], columns["deflection"], columns["length"]
    far = np.flatnonzero(np.abs(deflection) > _MAX_DEFLECTION * length)
    if len(far):
        first = int(far[0])
        limit = f"{100 * _MAX_DEFLECTION:g} % of the free length of {1e3 * length[first]:.4g} mm"
        what = f"deflection is {table.shown('deflection', first)}, more than {limit}; check the units, or the row"
        faults.append(table.fault(first, what))
    if float(force @ deflection) <= 0.0:
        what = "forces and deflections have opposite signs; use the same positive direction for both"
        faults.append(Fault("", what))
    if len(np.unique(force)) < 2 or len(force) < 3:
        rows = f"{len(force)} row{'s' * (len(force) != 1)} with {len(np.unique(force))} different forces"
        faults.append(Fault("", f"has {rows}; a scatter needs at least 3 rows with 2 forces"))
    elif np.ptp(deflection) == 0.0:
        what = f"deflection is {table.shown('deflection', 0)} in all {len(force)} rows at different forces; check the column"
        faults.append(Fault("", what))
    if "segments" in columns and columns["segments"][0] != round(columns["segments"][0]):
        faults.append(Fault("segments", f"must be a whole number; it is {columns['segments'][0]:g}"))
    return faults


def _test(table: MeasuredTable) -> _Test:
    columns = table.columns

    def first(name: str) -> float | None:
        return float(columns[name][0]) if name in columns else None

    length = first("length")
    assert length is not None
    repeat = columns.get("repeat", np.zeros(len(table)))
    segments = int(first("segments") or DEFAULT_SEGMENTS)
    return _Test(columns["force"], columns["deflection"], repeat, length, first("width"), first("thickness"), segments)


# results -------------------------------------------------------------------------------------------------------------


def _estimate(test: _Test, curve: CubicHermiteSpline, options: Options) -> Estimate:
    """EI with its variance; the variance follows from the scatter about the curve or, with enough repeats, from their
    differences.
    """
    best = fit_rigidity(test.force, test.deflection, test.length, curve)
    numbers = np.unique(test.repeat)
    if len(numbers) >= MIN_REPEATS:
        rows = [np.flatnonzero(test.repeat == number) for number in numbers]

        def refit(draw: np.ndarray) -> np.ndarray:
            drawn = np.concatenate([rows[k] for k in draw])
            return np.array([fit_rigidity(test.force[drawn], test.deflection[drawn], test.length, curve)])

        return from_samples(("EI",), np.array([best]), bootstrap(refit, len(rows), _DRAWS, options.seed), len(rows))
    modelled, by_log = _model_deflection(test.force, test.length, best, curve)
    return laplace(("EI",), np.array([best]), by_log[:, None] / best, modelled - test.deflection / test.length)


def _small_angle(test: _Test) -> float:
    """EI, N m^2, by the small-angle formula and least squares of the small deflections; of all deflections if fewer than two
    are small.
    """
    small = np.abs(test.deflection) <= _SMALL_ANGLE * test.length
    force, deflection = (test.force[small], test.deflection[small]) if small.sum() > 1 else (test.force, test.deflection)
    return float(force @ force * test.length**3 / (3.0 * (force @ deflection)))


def _quantities(test: _Test, estimate: Estimate, small: float, options: Options) -> list[Quantity]:
    value, error = float(estimate.values[0]), float(estimate.standard_error[0])
    low, high = estimate.interval(options.level)[0]

    def times(name: str, unit: str, factor: float) -> Quantity:
        return Quantity(name, factor * value, unit, factor * float(low), factor * float(high), factor * error)

    found = [
        times("EI", "N m^2", 1.0),
        times(f"K_theta of a joint, {test.segments} per length", "N m/rad", test.segments / test.length),
    ]
    if test.width is not None and test.thickness is not None:
        found.append(times("E = 12 EI/(w t^3)", "Pa", 12.0 / (test.width * test.thickness**3)))
    return [*found, Quantity("EI by the small-angle formula", small, "N m^2")]


def _numbers(test: _Test, estimate: Estimate, small: float) -> dict[str, Any]:
    return {
        "rigidity_Nm2": float(estimate.values[0]),
        "rigidity_variance": float(estimate.covariance[0, 0]),
        "freedom": estimate.freedom,
        "small_angle_rigidity_Nm2": small,
        "joint_stiffness_Nm_rad": float(estimate.values[0]) * test.segments / test.length,
        "segments": test.segments,
        "length_m": test.length,
        "width_m": test.width,
        "thickness_m": test.thickness,
        "largest_deflection_over_length": float(np.abs(test.deflection).max()) / test.length,
        "simulated_segments": SEGMENTS,
    }


def _lines(test: _Test) -> list[str]:
    largest = float(np.abs(test.deflection).max()) / test.length
    return [
        f"{len(test.force)} rows, deflections up to {100 * largest:.3g} % of the free length, {SEGMENTS} segments",
        "in a case: material.young = E with plate = false (the measured EI of a wide strip includes 1/(1 - nu^2))",
    ]


def _warnings(
    table: MeasuredTable, test: _Test, curve: CubicHermiteSpline, estimate: Estimate
) -> list[str]:
    warnings = list(table.notes)
    if test.width is None or test.thickness is None:
        missing = "Young's modulus is not computed, because width or thickness is missing"
        warnings.append(f"{missing}; give both as columns or in the TOML file")
    largest = float(np.abs(test.deflection).max()) / test.length
    if largest > _SMALL_ANGLE:
        at = largest * test.length
        error = float(np.abs(test.force).max()) * test.length**3 / (3.0 * at * float(estimate.values[0])) - 1.0
        formula = f"error of the small-angle formula at {1e3 * at:.3g} mm: {100 * error:+.2g} %"
        used = f"the EI of this formula is from deflections up to {100 * _SMALL_ANGLE:g} % of the length, if there are any"
        warnings.append(f"{formula}; {used}")
    modelled, _ = _model_deflection(test.force, test.length, float(estimate.values[0]), curve)
    residual = test.deflection / test.length - modelled
    offset = _offset(test, curve, float(estimate.values[0]), residual)
    if offset is not None:
        warnings.append(
            f"the data fit better with a deflection of {1e3 * offset * test.length:+.3g} mm at zero force; "
            "check the zero of the gauge and subtract it"
        )
    if len(np.unique(test.repeat)) == 2:
        warnings.append("two repeats are too few for their scatter; the interval is from all rows, add a third repeat")
    return warnings


def _offset(test: _Test, curve: CubicHermiteSpline, rigidity: float, residual: np.ndarray) -> float | None:
    """Deflection over length at zero force that best fits the residuals, if it is significant."""
    if len(residual) < 4:
        return None
    _, by_log = _model_deflection(test.force, test.length, rigidity, curve)
    jacobian = np.column_stack([by_log, np.ones(len(residual))])
    step, *_ = np.linalg.lstsq(jacobian, residual, rcond=None)
    found = laplace(("log EI", "offset"), step, jacobian, residual - jacobian @ step)
    error = float(found.standard_error[1])
    return float(step[1]) if abs(step[1]) > max(_OFFSET_ERRORS * error, 1e-9) else None


def _plot(
    test: _Test, curve: CubicHermiteSpline, estimate: Estimate, small: float, options: Options
) -> FitPlot:
    force = np.linspace(min(0.0, float(test.force.min())), max(0.0, float(test.force.max())), 200)
    value = float(estimate.values[0])
    modelled, by_log = _model_deflection(force, test.length, value, curve)
    half_width = np.abs(by_log) / value * estimate.quantile(options.level) * float(estimate.standard_error[0])
    scale = 1e3 * test.length
    label = f"segment model, {100 * options.level:g} % band"
    straight = 1e3 * force * test.length**3 / (3.0 * small)
    curves = [
        (label, force, scale * modelled, scale * (modelled - half_width), scale * (modelled + half_width)),
        ("small-angle formula", force, straight, None, None),
    ]
    return FitPlot(test.force, 1e3 * test.deflection, curves, "force (N)", "deflection (mm)")
