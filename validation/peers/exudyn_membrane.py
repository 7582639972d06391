"""The tensioned film with the ANCF thin plate of Exudyn and with fsm: prestress, modes, one second of free vibration.

    python -m validation.peers.exudyn_membrane [--cells 12] [--repeat 5] [--quick]

The times are those of the solvers alone, with models built and kernels compiled: medians of wall time and of the processor
time of the single thread, which depends less on other work of the machine. Prints a table and writes
out/peers/exudyn_membrane.csv; without Exudyn, only the rows of fsm.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from fsm.model.nodes.system.reduced import ReducedModel
from fsm.model.nodes.system.system import AncfSystem
from fsm.solve.equations.newton import equilibrium
from fsm.solve.modal import Modes, modes
from fsm.solve.outcome.run_io import SavedState
from fsm.solve.settings import Settings
from fsm.solve.simulate import simulate
from validation.benchmarks.demo import machine
from validation.membrane.film import (
    AMPLITUDE,
    FILM,
    SIDE,
    STRAIN,
    exact_frequencies,
    frequency,
    plucked_film,
    pulled_film,
    tensioned_film,
)

OUT = Path(__file__).parents[2] / "out" / "peers"
MODES = 20


@dataclass(frozen=True)
class Row:
    """One measurement: medians of the times, s, and the named error."""

    tool: str
    task: str
    setting: str
    wall: float
    processor: float
    runs: int
    error: float
    error_of: str


def timed(run: Callable[[], Any], repeat: int) -> tuple[float, float, Any]:
    """Medians of wall and processor time, s, after a warm-up run, and the result of the function."""
    result = run()
    walls, processors = [], []
    for _ in range(repeat):
        wall, processor = time.perf_counter(), time.thread_time()
        result = run()
        walls.append(time.perf_counter() - wall)
        processors.append(time.thread_time() - processor)
    return statistics.median(walls), statistics.median(processors), result


# fsm --------------------------------------------------------------------------------------------------------------------


def mode_error(found: np.ndarray) -> float:
    """Largest error of the six lowest frequencies."""
    return float(np.abs(found[:6] / exact_frequencies(6) - 1.0).max())


def fsm_rows(cells: int, repeat: int, true_frequency: float, quick: bool) -> list[Row]:
    """All rows of fsm."""
    rows = []
    pulled, _, _ = pulled_film(cells)
    wall, processor, _ = timed(lambda: equilibrium(pulled, pulled.initial()[0], np.array([0.0, 1.0])), repeat)
    rows.append(Row("fsm", "prestress", "Newton, one load step", wall, processor, repeat, 0.0, ""))
    system, _ = tensioned_film(cells)
    wall, processor, found = timed(lambda: modes(system, 0.0, system.start, MODES), repeat)
    error = mode_error(found.frequencies)
    rows.append(Row("fsm", f"{MODES} modes", "Lanczos", wall, processor, repeat, error, "six lowest"))
    shaken = system.start + 1e-4 * np.random.default_rng(0).normal(size=system.nq) * ~system.fixed
    wall, processor, _ = timed(lambda: system.force(0.0, shaken, None), 5 * repeat)
    rows.append(Row("fsm", "force", "", wall, processor, 5 * repeat, 0.0, ""))
    wall, processor, _ = timed(lambda: system.linearise(0.0, shaken, None), 5 * repeat)
    rows.append(Row("fsm", "force and tangent", "", wall, processor, 5 * repeat, 0.0, ""))
    plucked, height = plucked_film(cells)
    steps = (5e-4,) if quick else (1e-3, 5e-4, 2.5e-4)
    for step in steps:
        wall, processor, found_frequency = timed(lambda h=step: fsm_vibration(plucked, height, h), 1 if quick else 3)
        error = found_frequency / true_frequency - 1.0
        setting = f"generalized-alpha, h = {1e3 * step:g} ms"
        rows.append(Row("fsm", "1 s of vibration", setting, wall, processor, 1 if quick else 3, error, "frequency"))
    for cubic in (False, True):
        model, rate, built = reduced_model(plucked, 6, cubic)
        wall, processor, response = timed(lambda m=model, r=rate: m.respond(1.0, 2.5e-4, rate=r), repeat)
        lift = model.coordinates(response.amplitude)[:, height]
        error = frequency(response.time, lift) / true_frequency - 1.0
        setting = f"6 modes{', cubic' if cubic else ''} (made in {built:.2f} s)"
        rows.append(Row("fsm", "1 s of vibration, reduced", setting, wall, processor, repeat, error, "frequency"))
    return rows


def fsm_vibration(system: AncfSystem, height: int, step: float, duration: float = 1.0, method: str = "") -> float:
    """Frequency of the free vibration, Hz."""
    states: list[SavedState] = []
    if method:
        settings = Settings(method, 1e-4, duration)
    else:
        settings = Settings("generalized-alpha", 1e-3, duration, rho_inf=0.9, step=step)
    simulate(system, settings, np.arange(0.0, duration * (1 + 1e-9), 5e-4 if method else step), states.append)
    return frequency(np.array([s.time for s in states]), np.array([s.q[height] for s in states]))


def reduced_model(system: AncfSystem, count: int, cubic: bool) -> tuple[ReducedModel, np.ndarray, float]:
    """Model, initial rates, and time to build it from the tensioned state, including its modes."""
    begun = time.perf_counter()
    found: Modes = modes(system, 0.0, system.start, count)
    model = ReducedModel.of(system, 0.0, system.start, found.squared, found.shapes, cubic)
    rate = found.shapes @ (system.mass(system.start) @ system.rate)
    return model, rate, time.perf_counter() - begun


# Exudyn -----------------------------------------------------------------------------------------------------------------


class ExudynFilm:
    """The film in Exudyn; `integration` 0: full, 1 and 2: reduced."""

    def __init__(
        self, cells: int, integration: int, rate: np.ndarray | None = None, rest: np.ndarray | None = None
    ) -> None:
        import exudyn as exu
        from exudyn import itemInterface as item

        self.exu = exu
        self.system = exu.SystemContainer().AddSystem()
        plain, nu, t = FILM.stretch, FILM.poisson, FILM.thickness
        strain = plain * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
        x = np.linspace(0.0, SIDE, cells + 1)
        self.nodes = np.empty((cells + 1, cells + 1), dtype=int)
        for i in range(cells + 1):
            for j in range(cells + 1):
                reference = np.array([x[i], x[j], 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
                k = 9 * (i * (cells + 1) + j)
                start = np.zeros(9) if rest is None else rest[k : k + 9] - reference
                velocity = np.zeros(9) if rate is None else rate[k : k + 9]
                node = item.NodePointSlope12(
                    referenceCoordinates=reference.tolist(), initialCoordinates=start.tolist(),
                    initialVelocities=velocity.tolist(),
                )  # fmt: skip
                self.nodes[i, j] = self.system.AddNode(node)
        for i in range(cells):
            for j in range(cells):
                corners = [self.nodes[i, j], self.nodes[i + 1, j], self.nodes[i + 1, j + 1], self.nodes[i, j + 1]]
                plate = item.ObjectANCFThinPlate(
                    thickness=[t] * 4, density=FILM.density, strainCoefficients=strain,
                    curvatureCoefficients=strain * t * t / 12.0, nodeNumbers=[int(n) for n in corners],
                    useReducedOrderIntegration=integration,
                )  # fmt: skip
                self.system.AddObject(plate)
        self._hold(item, x, cells)

    def _hold(self, item: Any, x: np.ndarray, cells: int) -> None:
        """Positions of the edge and slopes along it, at the given strain."""
        ground = self.system.AddMarker(
            item.MarkerNodeCoordinate(nodeNumber=self.system.AddNode(item.NodePointGround()), coordinate=0)
        )
        held = []
        for i in range(cells + 1):
            for j in range(cells + 1):
                wanted: dict[int, float] = {}
                if i in (0, cells) or j in (0, cells):
                    wanted |= {0: STRAIN * (x[i] - SIDE / 2), 1: STRAIN * (x[j] - SIDE / 2), 2: 0.0}
                if j in (0, cells):
                    wanted |= {3: STRAIN, 4: 0.0, 5: 0.0}
                if i in (0, cells):
                    wanted |= {6: 0.0, 7: STRAIN, 8: 0.0}
                for coordinate, offset in wanted.items():
                    node = int(self.nodes[i, j])
                    marker = self.system.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
                    self.system.AddObject(item.CoordinateConstraint(markerNumbers=[ground, marker], offset=offset))
                    held.append((node, coordinate))
        middle = int(self.nodes[cells // 2, cells // 2])
        self.sensor = self.system.AddSensor(
            item.SensorNode(
                nodeNumber=middle, storeInternal=True, outputVariableType=self.exu.OutputVariableType.Displacement
            )
        )
        self.system.Assemble()
        self.held = [self.system.GetNodeODE2Index(node) + coordinate for node, coordinate in held]

    def settings(self) -> Any:
        """Settings: one thread, sparse matrices, no files."""
        options = self.exu.SimulationSettings()
        options.solution.file.write = False
        options.linearSolver.solverType = self.exu.LinearSolverType.EigenSparse
        options.parallel.numberOfThreads = 1
        options.staticSolver.numberOfLoadSteps = 1
        options.staticSolver.verboseMode = options.timeIntegration.verboseMode = 0
        return options

    def prestress(self) -> None:
        """Static solution, which becomes the initial state."""
        self.system.SolveStatic(self.settings(), updateInitialValues=True)

    def frequencies(self, count: int = MODES) -> np.ndarray:
        """The lowest, Hz."""
        values, _ = self.system.ComputeODE2Eigenvalues(
            self.settings(), useSparseSolver=True, numberOfEigenvalues=count, constrainedCoordinates=self.held,
            ignoreAlgebraicEquations=True, convert2Frequencies=True,
        )  # fmt: skip
        return np.asarray(values)

    def vibrate(self, step: float, duration: float) -> float:
        """Frequency of the free vibration, Hz; generalized alpha, modified Newton."""
        options = self.settings()
        options.timeIntegration.numberOfSteps = round(duration / step)
        options.timeIntegration.endTime = duration
        options.timeIntegration.newton.useModifiedNewton = True
        options.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        options.solution.sensors.writePeriod = step
        self.system.SolveDynamic(options)
        history = np.asarray(self.system.GetSensorStoredData(self.sensor))
        return frequency(history[:, 0], history[:, 3])


def exudyn_rows(cells: int, repeat: int, true_frequency: float, quick: bool) -> list[Row]:
    """All rows of Exudyn."""
    rows = []
    plucked, _ = plucked_film(cells)
    for integration in (0, 1):
        setting = ("full integration", "reduced integration")[integration]
        films = iter([ExudynFilm(cells, integration) for _ in range(repeat + 1)])
        wall, processor, _ = timed(lambda f=films: next(f).prestress(), repeat)
        rows.append(Row("Exudyn", "prestress", setting, wall, processor, repeat, 0.0, ""))
        film = ExudynFilm(cells, integration)
        film.prestress()
        wall, processor, found = timed(film.frequencies, min(repeat, 3))
        error = mode_error(found)
        rows.append(Row("Exudyn", f"{MODES} modes", setting, wall, processor, min(repeat, 3), error, "six lowest"))
    for step in (1e-3,) if quick else (1e-3, 5e-4):
        film = ExudynFilm(cells, 1, plucked.rate, plucked.start)
        wall, processor = time.perf_counter(), time.thread_time()
        error = film.vibrate(step, 1.0) / true_frequency - 1.0
        wall, processor = time.perf_counter() - wall, time.thread_time() - processor
        setting = f"reduced integration, h = {1e3 * step:g} ms"
        rows.append(Row("Exudyn", "1 s of vibration", setting, wall, processor, 1, error, "frequency"))
    return rows


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=12)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    plucked, height = plucked_film(options.cells)
    # the reference is on the same mesh, with the error control of Radau, over a tenth of the time
    true_frequency = fsm_vibration(plucked, height, 0.0, 0.1, "Radau-blocks")
    print(f"{machine()}\nfrequency at an amplitude of {1e3 * AMPLITUDE:g} mm: {true_frequency:.4f} Hz")
    rows = fsm_rows(options.cells, options.repeat, true_frequency, options.quick)
    if importlib.util.find_spec("exudyn") is not None:
        rows += exudyn_rows(options.cells, options.repeat, true_frequency, options.quick)
    for row in rows:
        error = f"{row.error:10.2e} {row.error_of}" if row.error_of else ""
        print(f"{row.tool:7} {row.task:26} {row.setting:46} {row.wall:9.4f} s {row.processor:9.4f} s {error}")
    OUT.mkdir(parents=True, exist_ok=True)
    with (OUT / "exudyn_membrane.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)])
        writer.writeheader()
        writer.writerows(asdict(row) for row in rows)


if __name__ == "__main__":
    main()
