"""Flexible facets of a scene: mesh, material, supports of the nodes, and points with frames."""

from __future__ import annotations

from dataclasses import dataclass, field

from fsm.case.models.facet_mesh import FacetMesh, MeshPoint
from fsm.case.models.fold_data import FoldData
from fsm.case.models.laminate import Laminate

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
    points : points of the mesh by the name of their frame
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
    points: dict[str, MeshPoint] = field(default_factory=dict)
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
