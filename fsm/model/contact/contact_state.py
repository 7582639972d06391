"""Contacts of one state of the bodies, with their forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.interactions.contact.shapes import ContactForces
from fsm.model.contact.contact_geometry import ActiveContacts, ContactKinematics
from fsm.model.contact.contact_memory import ContactMemory


@dataclass
class ContactState:
    """Contacts of one state with their forces; `sums` of every pair are computed on demand.

    `at` contains the depths at which the normal law is linearised. `acting` contains the normal forces of the linearised
    law.
    """

    touching: ActiveContacts
    memory: ContactMemory
    depth: np.ndarray
    share: np.ndarray
    measured: ContactKinematics
    at: np.ndarray
    acting: np.ndarray
    forces: ContactForces
    deflection: np.ndarray
    by_distance: np.ndarray | None
    by_turn: np.ndarray | None
    sums: np.ndarray | None = None
