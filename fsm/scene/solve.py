"""Settings of the solver and of records."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fsm.scene.model import Model, Name
from fsm.scene.units import Count, Force, Length, Number, Time

__all__ = ["Method", "Save", "SavedPoint", "Solve"]

Method = Literal[
    "auto", "static", "arc-length", "generalized-alpha", "mean-force", "newmark", "Radau-blocks", "Radau", "BDF", "LSODA"
]  # fmt: skip


class Solve(Model):
    """Settings of the solver.

    Attributes
    ----------
    method : str
        "auto"; "static" (equilibria as the drives move, dynamics during snap-through); "arc-length" (the equilibrium path
        through limit points, stable or not, without rates); "generalized-alpha"; "newmark";
        "mean-force" (keeps energy); "Radau-blocks" (Radau's method with block matrices), or SciPy's "Radau", "BDF", "LSODA".
    rtol : -
        Relative tolerance; absolute tolerances follow from it and the sizes of the scene. Statics chooses its increments so
        that the error of the predictor is sqrt(rtol) times the size of the structure (rotations: rad).
    increment : m
        First increment of the travel, statics only; absent: 1/200 of the travel.
    force_limit : N
        Magnitude of the force of the first drive at which a static run ends; absent: it ends with the travel.
    branch : 1 or -1
        Sign of the critical mode along which a path by arc length leaves its first bifurcation; absent: the path stays
        on the primary branch.
    imperfection : -
        Branch that statics follows after a bifurcation. Positive: along the critical mode, scaled so that its largest
        component is positive; negative: against it; 0: the branch of lower energy.
    rho_inf : -
        Spectral radius at infinite frequency, generalized-alpha only; absent: 0.6.
    step : s
        Fixed step size, generalized-alpha, mean force and Newmark only; absent: the error is controlled.
    end_time : s
        Required only without a drive.
    max_step : s
        Largest step size.
    max_steps : int
        Number of steps after which the solve stops (exit code 3).
    spatial : bool
        Whether each body has 6 degrees of freedom, even if the motion is planar.
    energy_abort : -
        Energy balance residual, over the reference energy, above which the solve stops (exit code 5).
    error_estimates : str
        Whether errors are stated that need further runs of the case: "auto" (if the run is short), "all" or "off".
    """

    method: Method = "auto"
    rtol: Annotated[Number, Field(ge=1e-12, le=1e-2)] = 1e-6
    end_time: Annotated[Time, Field(gt=0)] | None = None
    max_step: Annotated[Time, Field(gt=0)] | None = None
    max_steps: Annotated[Count, Field(ge=1)] = 200_000
    spatial: bool = False
    energy_abort: Annotated[Number, Field(gt=0)] = 0.05
    increment: Annotated[Length, Field(gt=0)] | None = None
    imperfection: Annotated[Number, Field(ge=-1, le=1)] = 0.0
    force_limit: Annotated[Force, Field(gt=0)] | None = None
    branch: Literal[-1, 1] | None = None
    rho_inf: Annotated[Number, Field(ge=0, le=1)] | None = None
    step: Annotated[Time, Field(gt=0)] | None = None
    error_estimates: Literal["auto", "all", "off"] = "auto"


class SavedPoint(Model):
    """Point of a rigid body or of a frame: `at` in body axes from the centre of mass, m."""

    body: Name
    at: tuple[Length, Length, Length] = (0.0, 0.0, 0.0)


class Save(Model):
    """Spacing of records: `every` in travel of the first drive, or `interval` in time; by default 200 intervals.

    Attributes
    ----------
    every : m
    interval : s
    channels : tuple of str
        Patterns of the channels to record, for example ``"crease.*.angle"``; ``*`` is any text, ``?`` any letter.
    points : dict of SavedPoint
        Points of bodies by name, for the channels ``point.<name>.position``, ``.displacement`` and ``.velocity``.
    """

    every: Annotated[Length, Field(gt=0)] | None = None
    interval: Annotated[Time, Field(gt=0)] | None = None
    channels: tuple[Annotated[str, Field(min_length=1, max_length=200)], ...] = ()
    points: dict[str, SavedPoint] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.every is not None and self.interval is not None:
            raise ValueError("give `every` (travel) or `interval` (time), not both")
        return self
