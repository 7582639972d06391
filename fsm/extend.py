"""Additions of users: contact laws and geometries, friction laws, laws and kinds of force elements, builders, channels.

A case names the Python file that registers the extensions, ``extensions = ["my_law.py"]``. See docs/extend. This module has
all that such a file imports from the package, also the units of its keys, the parts of a scene, and the errors.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel

from fsm.case.derived.contact_points import OF_SIDES
from fsm.case.models import scene as _scene
from fsm.case.models.case import Case
from fsm.case.models.coupling import OWN_COUPLINGS
from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.case.schema import units as _units
from fsm.case.schema.model import Model as Section
from fsm.case.schema.units import (
    Acceleration,
    Angle,
    AngularDamping,
    AngularSpeed,
    AngularStiffness,
    Area,
    Count,
    Damping,
    Density,
    Force,
    Inertia,
    Length,
    Mass,
    Moment,
    Number,
    Speed,
    Stiffness,
    Stress,
    Temperature,
    Time,
)
from fsm.channels.offer import Model, Offer, State, motion_of_bodies, offers
from fsm.errors import CaseError, Fault
from fsm.interactions.contact.contact_frame import add_contact_tangent
from fsm.kernels.addresses import floats_1d, floats_2d, floats_3d
from fsm.kernels.jit import kernel
from fsm.kernels.rotation import fill_rotation
from fsm.kernels.tables import Floats1, Floats2, Floats3, Integers1, Integers2, follows
from fsm.laws.friction import FRICTION_LAWS as OWN_FRICTION_LAWS
from fsm.laws.friction import FrictionLaw
from fsm.laws.normal import NORMAL_LAWS, NormalLaw
from fsm.model.bodies.contact_arrays import ContactArrays, forces_of, index_of
from fsm.model.contact.contact_table import ContactTable
from fsm.model.contact.pair_contacts import PairContacts
from fsm.model.contact.touching import Touching
from fsm.model.elements.couplings import (
    ANGLES,
    DISSIPATED,
    EFFORTS,
    ENERGIES,
    FIRST_PARAMETER,
    SPEEDS,
    STIFFNESSES,
    VISCOSITIES,
    Coupling,
)
from fsm.model.elements.law_elements import ElementLaw, PointKind
from fsm.registry import (
    BUILDERS,
    CONTACT_LAWS,
    COUPLINGS,
    ELEMENT_LAWS,
    FRICTION_LAWS,
    GEOMETRIES,
    POINT_KINDS,
    AddedBuilder,
    AddedLaw,
)
from fsm.results.channel import AXES, Dim

__all__ = [
    "ANGLES", "AXES", "DISSIPATED", "EFFORTS", "ENERGIES", "FIRST_PARAMETER", "SPEEDS", "STIFFNESSES", "VISCOSITIES",
    "Acceleration", "Angle", "AngularDamping", "AngularSpeed", "AngularStiffness", "Area", "Body", "CaseError",
    "ContactArrays", "Count", "Coupling", "Damping", "Density", "Dim", "ElementLaw", "Fault", "Floats1", "Floats2",
    "Floats3", "Force", "ForceElement", "FrictionLaw", "Inertia", "Integers1", "Integers2", "Length", "Mass", "Model",
    "Moment", "NormalLaw", "Number", "Offer", "PairContacts", "PointKind", "Scene", "Section", "Speed", "State", "Stiffness",
    "Stress", "Temperature", "Time", "Touching", "add_builder", "add_contact_law", "add_contact_tangent", "add_coupling",
    "add_element_law", "add_friction_law", "add_geometry", "add_point_element", "floats_1d", "floats_2d", "floats_3d",
    "fill_rotation", "follows", "forces_of", "index_of", "kernel", "motion_of_bodies", "offers",
]  # fmt: skip

# modules that extensions of earlier versions import
sys.modules.setdefault("fsm.scene.scene", _scene)
sys.modules.setdefault("fsm.scene.units", _units)

Built = TypeVar("Built", bound=BaseModel)


def add_contact_law(name: str, law: NormalLaw, parameters: type[BaseModel] | None = None, text: str = "") -> None:
    """Add a law of the normal force, ``[contact] law = name``.

    Parameters
    ----------
    name : str
    law : NormalLaw
        The function `params` of the law receives the section, in which `parameters` is a dict in SI.
    parameters : model of the section ``[contact.parameters]``, a `Section`
    text : description for `fsm check`

    Raises
    ------
    ValueError
        A law of the package has this name.
    """
    _add(CONTACT_LAWS, NORMAL_LAWS, name, AddedLaw(law, parameters, text or name))


def add_friction_law(name: str, law: FrictionLaw, parameters: type[BaseModel] | None = None, text: str = "") -> None:
    """Add a friction law, ``[friction] law = name``; arguments as in `add_contact_law`."""
    _add(FRICTION_LAWS, OWN_FRICTION_LAWS, name, AddedLaw(law, parameters, text or name))


def add_element_law(name: str, law: ElementLaw, parameters: type[BaseModel] | None = None, text: str = "") -> None:
    """Add a law of force elements, ``[[scene.elements]] law = name``; other arguments as in `add_contact_law`."""
    _add(ELEMENT_LAWS, {}, name, AddedLaw(law, parameters, text or name))


def add_point_element(name: str, kind: PointKind, parameters: type[BaseModel] | None = None, text: str = "") -> None:
    """Add a kind of elements between points, ``[[scene.point_elements]] kind = name``.

    Other arguments as in `add_contact_law`.
    """
    _add(POINT_KINDS, {}, name, AddedLaw(kind, parameters, text or name))


def add_coupling(name: str, kind: Coupling, parameters: type[BaseModel] | None = None, text: str = "") -> None:
    """Add a kind of elements on the coordinates of joints, ``[[scene.couplings]] kind = name``.

    Other arguments as in `add_contact_law`. The kernel of the kind is compiled, and so are the steps of its cases.
    """
    _add(COUPLINGS, OWN_COUPLINGS, name, AddedLaw(kind, parameters, text or name))


def add_geometry(
    name: str,
    build: Callable[[Touching], tuple[ContactTable, ...]],
    parameters: type[BaseModel] | None = None,
    text: str = "",
) -> None:
    """Add a contact geometry of pairs of bodies, ``[[scene.pairs]] geometry = name``.

    Parameters
    ----------
    name : str
    build : function
        ``build(touching) -> tables``, for example one `PairContacts`, of the pairs that name this geometry.
    parameters, text : as in `add_contact_law`

    The kernels of the geometry are compiled, and so are the steps of its cases. Contact laws, friction, impacts, depths in
    statics, energies and channels of the pairs follow from them.
    """
    _add(GEOMETRIES, dict.fromkeys(OF_SIDES), name, AddedLaw(build, parameters, text or name))


def add_builder(name: str, section: type[Built], build: Callable[[Built, Mapping[str, Any]], Scene]) -> None:
    """Add a section of a case from which a scene is built.

    Parameters
    ----------
    name : str
        Name of the section.
    section : model of the section, a `Section`
    build : function
        ``build(section, others) -> Scene``. `others` holds the other sections of the case by name. The function raises a
        `CaseError` with the faults of the section.

    Raises
    ------
    ValueError
        The case has a section with this name.
    """
    _add(BUILDERS, Case.model_fields, name, AddedBuilder(section, build))


def _add(kind: dict[str, Any], own: Mapping[str, Any], name: str, addition: Any) -> None:
    if name in own:
        raise ValueError(f"{name!r} is already a name in fsm; choose another name")
    kind[name] = addition
