"""Compilation of kernels in advance, by small cases that use them.

A table compiles its kernels before its workers start, so that no two processes compile the same kernel.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np

from fsm.analyses.choose import analysis_of
from fsm.builders import warm_up
from fsm.builders.warm_up import WarmUp
from fsm.interactions.surfaces.end_taper import add_taper_tangent
from fsm.kernels import jit
from fsm.kernels.blocks import BlockMatrix, BlockPattern, Elimination
from fsm.kernels.fronts import count_nonzero
from fsm.model.compile.compile_case import compile_case
from fsm.model.contact.surfaces.surface_contacts import SurfaceContacts
from fsm.model.elements.creases import CreaseGroup
from fsm.model.system.system import SegmentSystem
from fsm.run.compile_beside import compiled_beside
from fsm.run.progress import report_compilation
from fsm.solve.equations.equilibrium_step import EquilibriumStep
from fsm.solve.equations.linear import LinearSolver
from fsm.solve.equations.newton import negative_pivots
from fsm.solve.settings import PathSettings, Settings
from fsm.solve.simulate import simulate
from fsm.solve.statics.static import follow

SPACES = ("planar", "spatial")
_INTEGRATORS = ("generalized-alpha", "Radau")
_TEMPLATES = Path(__file__).parents[1] / "cli" / "templates"
"""Cases of `fsm init`."""


def _segments(make: Callable[[], WarmUp], methods: tuple[str, ...] = _INTEGRATORS) -> None:
    """Evaluate states with and without contact, and then solve the first instants."""
    warm = make()
    _, system = compile_case(warm.case)
    q, u = system.initial()
    pushed = np.zeros((system.n_free, system.size))
    moved = [system.bodies.names[i].startswith(warm.moved) for i in system.bodies.free]
    pushed[moved, 0], pushed[moved, 2 if system.size == 6 else 1] = warm.shift
    touching = system.retract(q, pushed.ravel())
    far_away = system.retract(q, 100.0 * pushed.ravel())
    memory = system.memory()
    for state in (touching, far_away, q):
        system.tangent(0.0, state, u)
        system.observe(0.0, state, u)
        system.shape(0.0, state)
        system.commit(0.0, state, u)
    system.restore(memory)
    for group in system.groups:
        if isinstance(group, CreaseGroup):  # for warnings on angles beyond the measured ones
            group.measure(*system.place(0.0, q, None), group.bodies, *group.geometry)
    if any(isinstance(contacts.geometry, SurfaceContacts) for contacts in system.contacts):
        _rare_contacts()
    for earlier in (0.0, -1.0):  # states at rest, and states with dampers
        EquilibriumStep(system, max_iterations=1, in_one_call=False).solve(0.0, touching, (earlier, q))
    end = 1e-3 * (system.end_time() or 1.0)
    if system.motions:
        follow(system, PathSettings(end, end / 2.0), [0.0, end], lambda saved: None)
        negative_pivots(system, 0.0, q)
    for method in methods:
        simulate(system, Settings(method, 1e-3, end), [0.0, end], lambda saved: None)


def compile_linear_solver() -> None:
    """Solve two small systems of equations, one symmetric and one unsymmetric."""
    pattern = BlockPattern(np.array([0, 2, 4]), np.array([0, 1, 0, 1]), 3)
    solver = LinearSolver()
    for coupling in (0.0, 0.1):
        data = np.zeros((4, 3, 3))
        data[[0, 3]] = np.eye(3)
        data[1] = coupling
        solver.factorise(BlockMatrix(pattern, data))
        solver.solve(np.ones(6))
        solver.negative_pivots()


class _Fronts(LinearSolver):
    """Solver that uses dense fronts for matrices of any size."""

    def _has_fronts(self, matrix: BlockMatrix, known: Elimination) -> bool:
        super()._has_fronts(matrix, known)
        count_nonzero(matrix.data)
        return True


def _fronts() -> None:
    """Solve a small system by dense fronts, which the comparison meshes of films use."""
    pattern = BlockPattern(np.array([0, 2, 4]), np.array([0, 1, 0, 1]), 3)
    solver = _Fronts()
    data = np.zeros((4, 3, 3))
    data[[0, 3]] = np.eye(3)
    solver.factorise(BlockMatrix(pattern, data))
    solver.solve(np.ones(6))
    solver._solve_all(np.ones((2, 6)))
    solver.negative_pivots()


def _rare_contacts() -> None:
    """Compile the kernels of contacts at the ends of surfaces by calls without contacts; few states use these kernels."""
    none, numbers, block, blocks = np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 0)), np.zeros((0, 0, 0))
    bodies, gradient = np.zeros((0, 3), dtype=np.int64), blocks
    add_taper_tangent(bodies, gradient, numbers, block, blocks, none, none, none, block, numbers, numbers, numbers, blocks)


def _springs(spatial: bool, curved: bool) -> None:
    """Solve the start of the equilibrium path of a small strip without contact."""
    _, system = compile_case(warm_up.warm_up_springs(spatial, curved))
    end = 1e-3 * (system.end_time() or 1.0)
    follow(system, PathSettings(end, end / 2.0), [0.0, end], lambda saved: None)


def _many_steps(spatial: bool, method: str = "generalized-alpha") -> None:
    """Solve the first instants of a small strip without drive and without contact."""
    _, system = compile_case(warm_up.warm_up_springs(spatial))
    alone = SegmentSystem(system.bodies, (), system.groups, ())
    simulate(alone, Settings(method, 1e-3, 1e-6, step=5e-7), [0.0], lambda saved: None)


def _film(law: str) -> None:
    """Solve the first instants of a small film with a patch and cables."""
    analysis = analysis_of(warm_up.warm_up_membrane(law))
    analysis.initialise([])
    settings = Settings("generalized-alpha", 1e-3, 2e-4, step=1e-4)
    simulate(analysis.system, settings, [0.0], lambda saved: None, start=(0.0, *analysis.system.initial()))


def _bars(bars: str) -> None:
    """Solve the first instants of a small scissor array."""
    analysis = analysis_of(warm_up.warm_up_scissor(bars))
    simulate(analysis.system, Settings(analysis.steps()[-1].method, 1e-3, 2e-4), [0.0], lambda saved: None)


def _whole(template: str, *overrides: str) -> None:
    """Run a shortened case of `fsm init` as `fsm run` does, without figures."""
    from fsm.case.loading.load_case import load_case
    from fsm.run.run_case import run_case  # imports the kernels of all analyses

    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run_case(load_case(_TEMPLATES / f"{template}.toml", overrides), Path(folder) / "run", progress=False, figures=False)


KINDS: dict[str, tuple[Callable[[], None], ...]] = {
    **{space: (partial(_segments, partial(warm_up.warm_up_strip, space == "spatial"), ()),) for space in SPACES},
    **{f"in time, {space}": (partial(_segments, partial(warm_up.warm_up_strip, space == "spatial")),) for space in SPACES},
    **{
        f"hysteresis, {space}": (partial(_segments, partial(warm_up.warm_up_strip, space == "spatial", True), ()),)
        for space in SPACES
    },
    "lattice": (partial(_segments, warm_up.warm_up_lattice),),
    "film": (partial(_film, "plain"), partial(_film, "tension-field"), _fronts),
    "bars": tuple(partial(_bars, element) for element in ("section", "green", "cable")),
    "rigid bars": (partial(_bars, "rigid"),),
    "plates": tuple(partial(_segments, partial(warm_up.warm_up_plates, spatial)) for spatial in (False, True)),
    **{f"steps in one kernel, {space}": (partial(_many_steps, space == "spatial"),) for space in SPACES},
    **{f"mean-force method, {space}": (partial(_many_steps, space == "spatial", "mean-force"),) for space in SPACES},
    **{f"statics in one kernel, {space}": (partial(_springs, space == "spatial", False),) for space in SPACES},
    **{f"statics with tabulated creases, {space}": (partial(_springs, space == "spatial", True),) for space in SPACES},
    **{
        f"structured Radau, {space}": (
            partial(_segments, partial(warm_up.warm_up_strip, space == "spatial"), ("Radau-blocks",)),
        )
        for space in SPACES
    },
    **{kind: tuple(partial(_whole, *case) for case in cases) for kind, cases in warm_up.WHOLE.items()},
}
"""Functions that compile the kernels of each kind (`fsm.analyses.analysis.Analysis.kernels`), rare kinds included."""


def compile_ahead(kinds: Iterable[str] = tuple(KINDS), show: bool = True) -> None:
    """Compile the kernels of these kinds on two processors, or load them from the cache.

    Parameters
    ----------
    kinds : iterable of str
        Keys of `KINDS`.
    show : bool
        Report on standard error that kernels are compiled.
    """
    wanted = tuple(kinds)
    with compiled_beside(wanted):
        for kind in wanted:
            with report_compilation(show, kind, jit):
                for use in KINDS[kind]:
                    use()
