"""Vibration of a tensioned film after an impact: tension, natural modes, history, frequency."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from fsm.analyses.analysis import MODAL, OneStep, Solver, StatedErrors
from fsm.analyses.comparison import Statement
from fsm.analyses.deployed import DeployedFilm
from fsm.analyses.film import FilmMesh, build_film, mean_strain, on_other_mesh
from fsm.analyses.mesh_error import MeshError, OnMesh, mesh_error
from fsm.analyses.natural import natural_modes
from fsm.analyses.reduced import ModelError, ReducedSolve, error_against_full, reduced_model
from fsm.analyses.stretch import as_deployed, stretched
from fsm.analyses.summary_errors import SummaryErrors, summary_errors
from fsm.case.models.case import Case
from fsm.case.models.membrane import HalfSinePulse, Impact, MeasuredPulse, Vibration
from fsm.case.plan.record_count import record_count
from fsm.errors import CaseError, Fault, NotConverged
from fsm.kernels.programs import Program, half_sine, rectangle, sampled
from fsm.model.nodes.films.film import FilmStress, MembraneGroup
from fsm.model.nodes.loading import Forcing, Loading
from fsm.model.nodes.system.reduced import ReducedModel
from fsm.model.nodes.system.system import AncfSystem
from fsm.model.nodes.system.tension_state import TensionState, tension_state
from fsm.model.plan.planned import save_times
from fsm.results.film import Film
from fsm.results.solution import Layout, Solution
from fsm.results.vibration import frequency_warnings, summarise_vibration
from fsm.solve.modal import Modes
from fsm.solve.outcome.run_io import Statistics
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.time.stepwise_run import GENERALIZED_ALPHA, MEAN_FORCE, NEWMARK

_PER_PERIOD = 10.0
"""Default number of samples in a period of the highest requested mode."""
_SLACKEST = 0.5
"""Largest part of the film that may be slack."""
_RELEASED = 1e-3
"""Ratio of the largest stress to the stress of the requested tension, below which the supports have released the film.
The same number is also the ratio of the force at a pulled point to the pull, above which the point counts as free."""
_GOOD = 0.02
"""Largest error of the reduced model against the full one for its use."""
_STEPS = 40.0
"""Number of steps of the full model in the pulse, or in a period of the lowest mode if shorter."""
_ORDER = {"taut": 2.0, "patches": 0.4, "wrinkled": 0.3}
"""Order of the frequencies in the size of the elements, for the stated error."""


class VibrationAnalysis(OneStep):
    """Compiled film; see `Analysis`.

    Parameters
    ----------
    case : Case
    source : name of the file in messages
    deployed : film of the first stage, instead of that of the case
    """

    kernels = ("film",)
    step_name = "vibrate"
    system: AncfSystem

    def __init__(self, case: Case, source: str, deployed: DeployedFilm | None = None) -> None:
        self.case, self.source, self.deployed = case, source, deployed
        self.vibration = case.vibration or Vibration()
        self.film = build_film(case) if deployed is None else deployed.film
        self.points = {name: self.film.point(*place) for name, place in self._places().items()}

    def initialise(self, warnings: list[str]) -> None:
        """Tension the film, set its supports, and compute its modes.

        Raises
        ------
        CaseError
            The film is slack, or it is unstable and would wrinkle.
        """
        loading = self._loading(self.film)
        if self.deployed is None and not self._plain_by_choice(loading):
            loading = self._loading(self.film)
            self.system = stretched(self.case, self.film, loading)
        elif self.deployed is not None:
            self.system = as_deployed(self.case, self.deployed, loading)
        q, _ = self.system.initial()
        self.state = tension_state(self.system, 0.0, q)
        self._refuse_slack(self.state)
        self._refuse_all_held()
        self._refuse_released(q)
        self.rest = {name: point.position(q) for name, point in self.points.items()}
        self.axes = {name: point.axes(q) for name, point in self.points.items()}
        self.modes = natural_modes(self.system, q, self.vibration.modes)
        self._refuse_unstable(self.modes)
        self._choose_model(warnings)
        self.mesh_error = self._mesh_error()

    def method(self) -> tuple[str, str]:
        """See `Analysis`."""
        if self.model is not None:
            return MODAL, self.reason
        solve = self.case.solve
        if solve.method != "auto":
            return solve.method, self.reason
        return (MEAN_FORCE if solve.rho_inf is None else GENERALIZED_ALPHA), self.reason

    def _plain_by_choice(self, loading: Loading) -> bool:
        """Choose between plain film and tension field for "auto"; True if the plain film has been brought to rest."""
        tension = self.case.tension
        if tension is None or tension.film != "auto":
            return False
        plain, tension_only = (
            self.case.model_copy(update={"tension": tension.model_copy(update={"film": film})})
            for film in ("plain", "tension-field")
        )
        try:
            system = stretched(plain, self.film, loading)
            q, _ = system.initial()
            taut = tension_state(system, 0.0, q).taut >= 1.0
            if taut and not natural_modes(system, q, 1).unstable.any():
                self.case, self.system = plain, system
                return True
        except NotConverged:  # the flat film buckles during tensioning
            pass
        self.case, self.film = tension_only, build_film(tension_only)
        self.points = {name: self.film.point(*place) for name, place in self._places().items()}
        return False

    def _choose_model(self, warnings: list[str]) -> None:
        """Select the reduced model if it is requested or accurate enough, and report its error."""
        wanted = self.vibration.model
        self.model: ReducedModel | None = None
        self.error: ModelError | None = None
        self.reason = "requested"
        impact = self.case.impact
        if impact is None or self.case.solve.method != "auto" or wanted == "full":
            return
        if np.any(self.modes.squared <= 0.0):  # the frequency is zero except for round-off, so a slack part has no support
            self.reason = "a mode has no stiffness, so there is no reduced model"
            if wanted == "reduced":
                warnings.append(f'reduced model: {self.reason}; solved with vibration.model = "full"')
            return
        model = reduced_model(self.system, self.modes, self.vibration.stretch)
        point = self.film.point(*impact.point)
        rest = point.position(self.system.initial()[0])
        self.error = error_against_full(
            self.system, model, self._first_step(), self.vibration.duration, self.probes,
            lambda q: point.position(q) - rest, math.inf if wanted == "reduced" else _GOOD,
        )  # fmt: skip
        good = self.error.largest <= _GOOD
        self.reason = f"{len(self.modes.squared)} modes, {self.error.text}"
        if wanted == "reduced" or good:
            self.model = model
            if not good:
                warnings.append(f"reduced model: {self.reason}; {self.error.remedy}")

    def _step(self) -> float:
        """Step of the full model: `_first_step` or half of this step."""
        return self._first_step() if self._stated is None else self._stated.step

    def _first_step(self) -> float:
        """Step of the case; by default a 40th of the pulse or of the period of the lowest mode, whichever is
        shorter.
        """
        if self.case.solve.step is not None:
            return self.case.solve.step
        period = 1.0 / max(float(np.abs(self.modes.frequencies).min()), 1.0 / self.vibration.duration)
        return min(period, self._pulse_end() or period) / _STEPS

    def settings(self, method: str) -> Settings | PathSettings:
        """See `Analysis`; without an impact there is no motion to solve."""
        return self._settings(method, self._step())

    def _settings(self, method: str, fixed: float) -> Settings:
        solve = self.case.solve
        end = self.vibration.duration if self.case.impact is not None else 0.0
        step = fixed if method in (GENERALIZED_ALPHA, NEWMARK, MEAN_FORCE) else None
        settings = Settings(
            method, solve.rtol, end, solve.max_step or math.inf, solve.max_steps, solve.energy_abort, step=step,
            judge_losses=method != GENERALIZED_ALPHA,
        )  # fmt: skip
        return settings if solve.rho_inf is None else replace(settings, rho_inf=solve.rho_inf)

    def record_times(self, end: float) -> list[float]:
        """See `Analysis`; by default at most `save.intervals` of the samples, evenly spaced."""
        if self.case.save.interval is not None or not end:
            return save_times(self.case.save, None, end)
        samples = self.sample_times(end)
        return [*samples[:: max(1, math.ceil(len(samples) / self.case.save.number))], end]

    def sample_times(self, end: float) -> list[float]:
        """Times at equal intervals, from the case or from the highest mode; fixed steps are not shortened for them."""
        if not end:
            return [0.0]
        step = self.vibration.sampling
        if step is None:
            step = 1.0 / (_PER_PERIOD * max(float(np.abs(self.modes.frequencies).max()), 1.0 / end))
            fixed = self._step()
            step = fixed * max(1, math.floor(step / fixed)) if self.model is None else end / math.ceil(end / step)
        return [k * step for k in range(record_count(end, step, "vibration.sampling") + 1)]

    def layout(self) -> Layout:
        """See `Analysis`."""
        groups = [group for group in self.film.mesh.groups if isinstance(group, MembraneGroup)]
        return Layout(
            dimension="spatial",
            panel=self.film.cells.ravel(),
            thickness=groups[0].material.thickness,
            film=self._film(),
        )

    def probes(self, q: np.ndarray) -> np.ndarray:
        """See `Analysis`."""
        moved = [self.axes[name] @ (point.position(q) - self.rest[name]) for name, point in self.points.items()]
        return np.array(moved)

    def own_solver(self) -> Solver | None:
        """Solver of the reduced model, if it is used and there is an impact."""
        return None if self.model is None else ReducedSolve(self.system, self.model).go

    def summarise(self, solution: Solution, statistics: Statistics) -> dict[str, Any]:
        """Frequency, amplitudes, modes, tension."""
        state = self.state
        error = self.error if self.model is not None else None
        found = summarise_vibration(solution, self._pulse_end())
        frequency, mesh = found["frequency_hz"], self.mesh_error
        return found | {
            "step_error": None if self._stated is None else self._stated.of_step,
            "point_force_error": None if self._stated is None else self._stated.of_point,
            "mesh_error_frequency": None if mesh is None or frequency is None else mesh.at(frequency),
            "reduced_error": None if error is None else error.probes,
            "reduced_error_struck": None if error is None else error.at_impact,
            "reduced_force_error": None if error is None else error.stretch,
            "modes_hz": [float(f) for f in self.modes.frequencies],
            "mesh_error_modes": None if mesh is None else [e if math.isfinite(e) else None for e in mesh.modes.tolist()],
            "mesh_error_amplitude": None if mesh is None else mesh.amplitude,
            "film": "plain" if self.case.tension is None else self.case.tension.film,
            "tension_state": {
                "largest_stress": state.largest,
                "smallest_stress": state.smallest,
                "taut_fraction": state.taut,
                "wrinkled_fraction": state.wrinkled,
                "slack_fraction": state.slack,
            },
        }

    def stated_errors(self, solution: Solution, statistics: Statistics, summary: dict[str, Any]) -> StatedErrors:
        """See `Analysis`."""
        mesh: Statement = {"by": "not estimated: no comparison mesh, or no equilibrium on it; compare with another mesh"}
        if self.mesh_error is not None:
            finer = self.mesh_error.finer
            mesh = {"by": f"modes on a {'finer' if finer else 'coarser'} mesh", "modes": summary["mesh_error_modes"]}
            mesh |= {name: summary[f"mesh_error_{name}"] for name in ("frequency", "amplitude")}
        steps: Statement = {"by": "none: nothing moves"}
        if self.model is not None:
            steps = {"by": "none: the modes of the reduced model are integrated exactly; see reduced_error"}
        elif summary["step_error"] is not None:
            steps = {"by": "first 80 steps with half the step", "displacements": summary["step_error"]}
        elif self.case.impact is not None:
            steps = {"by": "not estimated; compare with another solve.step or solve.rtol"}
        return {"mesh": mesh, "steps": steps}

    def warnings(self, solution: Solution, summary: dict[str, Any]) -> list[str]:
        """Warnings on an uncertain frequency or decay, on the step, and on a coarse mesh."""
        found = frequency_warnings(solution.samples.time, summary)
        found += [] if self._stated is None else self._stated.warnings()
        if self.mesh_error is not None:
            remedy = "give more deployed.elements_across" if self.deployed is not None else self._finer_mesh()
            found += self.mesh_error.warnings(summary["frequency_hz"], remedy)
        return found

    # inside -----------------------------------------------------------------------------------------------------------

    def _wrinkled(self) -> bool:
        """Whether a part of the film is not taut, as a tension field or with resolved wrinkles."""
        return self.case.tension is not None and self.case.tension.film != "plain" and self.state.taut < 1.0

    def _finer_mesh(self) -> str:
        """Remedy for a coarse mesh."""
        if self._wrinkled():
            return "give a finer membrane.mesh; modes of wrinkled and slack parts need many elements"
        return "give a finer membrane.mesh"

    def _places(self) -> dict[str, tuple[float, float]]:
        """Probes by name, with the centre and the first patch unless the case has probes with these names."""
        places = {"center": (0.0, 0.0)}
        if self.film.patches:
            first = self.film.patches[0]
            places["patch"] = (first.x, first.y)
        return places | self.vibration.probes

    def _mesh_error(self) -> MeshError | None:
        """Error due to the mesh, from another mesh; None if no mesh differs enough, or if no equilibrium is found."""
        if self.system.fixed.all():
            return None
        try:
            found = self._on_other_mesh()
        except NotConverged:
            return None
        if found is None:
            return None
        film, system, ratio = found
        duration = self.vibration.duration if self.case.impact is not None else 0.0
        step = min(self._first_step(), self.vibration.sampling or math.inf)
        own, other = (
            OnMesh(system, self._deflection(film))
            for system, film in ((self.system, self.film), (system, film))
        )
        wrinkled = self._wrinkled()
        order = _ORDER["wrinkled" if wrinkled else "patches" if self.film.patches else "taut"]
        return mesh_error(own, other, ratio, order, wrinkled, self.vibration.modes, duration, step)

    def _on_other_mesh(self) -> tuple[FilmMesh, AncfSystem, float] | None:
        """Film on the comparison mesh, its system at rest, and the ratio of the numbers of elements in a direction."""
        if self.deployed is not None:
            finer = self.deployed.finer
            if finer is None:
                return None
            ratio = finer.film.cells.shape[1] / self.film.cells.shape[1]
            return finer.film, as_deployed(self.case, finer, self._loading(finer.film)), ratio
        found = on_other_mesh(self.case)
        if found is None:
            return None
        film = build_film(self.case, found[0])
        return film, stretched(self.case, film, self._loading(film)), found[1]

    @cached_property
    def _stated(self) -> SummaryErrors | None:
        """Step of the full model and its errors; a default step is halved once if its error is large."""
        impact = self.case.impact
        method = self.method()[0]
        if self.model is not None or impact is None or method not in (GENERALIZED_ALPHA, NEWMARK, MEAN_FORCE):
            return None
        size, element = impact.size or 0.0, self.film.element(*impact.point)
        spread = None
        if size < max(element):
            loading = self._loading(self.film, (max(size, element[0]), max(size, element[1])))
            spread = self.system.held(self.system.initial()[0], np.zeros(0, dtype=np.int64), loading)
        halved = 1 if self.case.solve.step is None else 0
        settings = self._settings(method, self._first_step())
        return summary_errors(self.system, spread, settings, self.probes, halved)

    def _deflection(self, film: FilmMesh) -> Callable[[np.ndarray], float]:
        """Function of a configuration: normal displacement of the centre on a mesh, up to a constant."""
        point, normal = film.point(*self._places()["center"]), self.axes["center"][2]
        return lambda q: float(normal @ point.position(q))

    def _loading(self, film: FilmMesh, sides: tuple[float, float] | None = None) -> Loading:
        """Loading, with the impact force spread as in the case, or over a rectangle with these sides (m)."""
        forcings: tuple[Forcing, ...] = ()
        impact = self.case.impact
        if impact is not None:
            top, time = _pulse(impact)
            normal = film.point(*impact.point).axes(film.mesh.coordinates)[2]
            size = impact.size or 0.0
            forcings = (Forcing(film.load(*impact.point, sides or (size, size), top * normal), time),)
        air = self.case.damping.air if self.case.damping else 0.0
        return Loading(forcings, gravity=self.case.gravity, mass_damping=air)

    def _pulse_end(self) -> float:
        impact = self.case.impact
        return 0.0 if impact is None else max(_pulse(impact)[1].breaks())

    def _refuse_all_held(self) -> None:
        if self.system.fixed.all():
            place = "membrane.mesh" if self.deployed is None else "deployed"
            raise CaseError([Fault(place, "all coordinates are held: nothing can vibrate; refine the mesh")], self.source)

    def _refuse_released(self, q: np.ndarray) -> None:
        """Refuse supports that leave pulled points free, because the film would not be at rest."""
        pull = None if self.deployed is not None or self.case.tension is None else self.case.tension.pull
        if pull is None:
            return
        ends = self.film.ends[:, None] + np.arange(2)
        free = ~self.system.fixed[ends]
        weight = self.system.held(q, np.zeros(0, dtype=np.int64), Loading(gravity=self.case.gravity))
        released = float(np.abs(np.where(free, weight.force(0.0, q, None)[ends], 0.0)).max(initial=0.0))
        if released > _RELEASED * pull:
            text = (
                f"the supports leave pulled points free: {released:.3g} N of the pull of {pull:.3g} N is not held, and "
                "the film is not at rest; hold the pulled points in x and y too (fixed)"
            )
            raise CaseError([Fault("support", text)], self.source)

    def _refuse_unstable(self, found: Modes) -> None:
        if not found.unstable.any():
            return
        lowest = float(found.frequencies[0])
        text = (
            f"the tensioned film is unstable and would wrinkle ({int(found.unstable.sum())} modes grow, the fastest at "
            f"{2 * math.pi * abs(lowest):.3g} 1/s)"
        )
        hint = {
            "plain": 'set film = "tension-field" (or "auto"), which carries no compression, or "wrinkles"',
            "wrinkles": "these wrinkles are not resolved; refine the mesh",
            "tension-field": "refine the mesh, or increase the tension",
        }
        if self.case.tension is None:
            raise CaseError([Fault("deployed", f"{text}; give more elements_across")], self.source)
        raise CaseError([Fault("tension.film", f"{text}; {hint[self.case.tension.film]}")], self.source)

    def _refuse_slack(self, state: TensionState) -> None:
        if state.slack > _SLACKEST or not state.largest > 0.0:
            text = f"the film is slack: {100 * state.slack:.0f} % of it carries no tension; increase the tension"
            raise CaseError([Fault("tension" if self.deployed is None else "drive", text)], self.source)
        material = self.case.material
        if self.deployed is not None or material is None:
            return
        asked = material.young * mean_strain(self.case)
        if state.largest < _RELEASED * asked:
            text = (
                f"the film becomes slack on its supports: its largest stress is {state.largest:.3g} Pa, but the tension "
                f"requires about {asked:.3g} Pa; hold the pulled points in x and y too (fixed)"
            )
            raise CaseError([Fault("support", text)], self.source)

    def _film(self) -> Film:
        q, _ = self.system.initial()
        count = self.film.cells.size
        stress, direction = np.zeros((count, 2)), np.zeros((count, 3))
        kind = np.zeros(count, dtype=np.int64)
        kinds = self.film.cells.ravel()
        groups = [group for group in self.film.mesh.groups if isinstance(group, MembraneGroup)]
        for number, group in zip(np.unique(kinds), groups, strict=True):
            where, part = kinds == number, group.stress(q)
            stress[where] = part.principal.mean(axis=1)
            direction[where] = _mean_direction(part)
            kind[where] = np.round(part.state.mean(axis=1)).astype(np.int64)
        shape = self.system.shape(0.0, q)
        moved = np.array([self.system.shape(0.0, q + mode) - shape for mode in self.modes.shapes])
        largest = np.abs(moved).reshape(len(moved), -1).max(axis=1, initial=1e-300)
        return Film(
            probe_names=tuple(self.points),
            probe_rest=np.array(list(self.rest.values())),
            frequency=self.modes.frequencies,
            mode_shape=moved / largest[:, None, None, None],
            stress=stress,
            direction=direction,
            state=kind,
        )


def _mean_direction(stress: FilmStress) -> np.ndarray:
    """Direction of the larger stress of every element, (m, 3): mean over its points, weighted by the stress difference."""
    weight = stress.principal[..., 0] - stress.principal[..., 1]
    tensor = np.einsum("ms,msa,msb->mab", weight, stress.direction, stress.direction)
    return np.asarray(np.linalg.eigh(tensor)[1][..., -1])


def _pulse(impact: Impact) -> tuple[float, Program]:
    """Force (N), and its factor as a function of time."""
    if isinstance(impact, MeasuredPulse):
        return 1.0, sampled(impact.time, impact.force)
    if isinstance(impact, HalfSinePulse):
        return impact.force, half_sine(impact.duration)
    return impact.force, rectangle(impact.duration)
