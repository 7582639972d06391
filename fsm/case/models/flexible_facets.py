"""Flexible facets of a scene: mesh, material, supports of the nodes, and points with frames.

Fold data of flexible facets or of bars: laws, shares of their moments, rest angles, dampers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from fsm.case.models.facet_mesh import FacetMesh, MeshPoint
from fsm.case.models.laminate import Laminate
from fsm.case.models.materials import Crease, LinearCrease

UNIT = LinearCrease(stiffness=1.0)
"""Law of linear folds; the share of such a fold is its stiffness."""


@dataclass(frozen=True, eq=False)
class FoldData:
    """Data of folds; each array has one item for each fold.

    Attributes
    ----------
    laws : crease laws of the folds
    law : int array
        Number of the law of each fold.
    share : factor of the law; N m/rad for `UNIT`
    rest, start : rad
        Rest angles, and fold angles at the start.
    damping : N m s/rad
    turning : N m
        Stiffness times the change of the rest angle from the start to `end`.
    rise : N m/rad
        Stiffness of the moment that rises beyond `linear_to` (rad).
    end : s
        Time until which rest angles move.
    names : names of the creases and bend lines of the pattern
    joint : int array
        Index of each fold in `names`; -1 for other joints.
    length : length of each fold, m
    """

    laws: tuple[Crease, ...]
    law: np.ndarray
    share: np.ndarray
    rest: np.ndarray
    start: np.ndarray
    damping: np.ndarray
    turning: np.ndarray
    rise: np.ndarray = field(default_factory=lambda: np.zeros(0))
    linear_to: float = math.pi
    end: float | None = None
    names: tuple[str, ...] = ()
    joint: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    length: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def linear(
        cls, stiffness: np.ndarray, rest: np.ndarray, start: np.ndarray, linear_to: float = math.pi
    ) -> FoldData:
        """Linear folds without dampers."""
        none = np.zeros(len(rest))
        numbers = np.zeros(len(rest), dtype=np.int64)
        return cls(
            (UNIT,), numbers, stiffness, rest, start, none, none, stiffness, linear_to, joint=numbers - 1, length=none
        )

    def part(self, chosen: slice) -> FoldData:
        """Selected folds, as a new object."""
        names = "law", "share", "rest", "start", "damping", "turning", "rise", "joint", "length"
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})


SHEET = "sheet"
"""Name of the part that carries the frames of flexible facets."""


@dataclass(frozen=True, eq=False)
class FlexibleFacets:
    """Flexible facets of a sheet.

    Attributes
    ----------
    mesh : FacetMesh
    young, poisson, density, thickness : Pa, -, kg/m^3, m
    viscosity : s
        Kelvin-Voigt time of the facets.
    folds : folds at every node of the creases of the mesh, in order; None without creases
    held : components (x, y, z: 0, 1, 2) of vectors that cannot move, by the number of the vector
    probes : points by the name of a probe
    laminate : stiffness of the plies, which replaces the stiffness of an isotropic plate
    rounding : half-width, as a strain, of the rounded kinks of a tension field; None: facets carry compressive stress
    """

    mesh: FacetMesh
    young: float
    poisson: float
    density: float
    thickness: float
    viscosity: float = 0.0
    folds: FoldData | None = None
    held: dict[int, set[int]] = field(default_factory=dict)
    probes: dict[str, MeshPoint] = field(default_factory=dict)
    laminate: Laminate | None = None
    rounding: float | None = None

    @property
    def areal_density(self) -> float:
        """Mass per area, kg/m^2."""
        return self.density * self.thickness if self.laminate is None else self.laminate.areal_density

    @property
    def mass(self) -> float:
        """Mass of all facets, kg."""
        return self.areal_density * self.mesh.area

    @property
    def hinge_stiffness(self) -> list[float]:
        """Stiffness of all creases with a stiffness, and stiffness of a square plate against uniform bending, N
        m/rad.
        """
        folds = self.folds
        creases: list[float] = []
        if folds is not None:
            creases = [float(folds.rise[folds.joint == number].sum()) for number in range(len(folds.names))]
        plate = self.young * self.thickness**3 / (12.0 * (1.0 - self.poisson**2))
        return [stiffness for stiffness in creases if stiffness > 0.0] + [plate]
