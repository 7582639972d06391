"""Detection of impacts among contacts, and steps that resolve them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fsm.interactions.contact import impacts
from fsm.interactions.contact.impacts import CORNER_WEIGHT, ImpactRules, shared_weight
from fsm.model.contact.contact_geometry import ActiveContacts, ContactGeometry, ContactKinematics
from fsm.model.contact.contact_memory import ContactMemory
from fsm.model.contact.normal_force import NormalForce

_STEPS, _FEWER_STEPS = 90, 30
"""Approximate minimum number of steps in an impact: first for laws with a coefficient of restitution, then for other
laws."""
_IMPACT_SPEED = 3.0
"""Closing speed, relative to the speed floor of its law, above which a contact is an impact."""


@dataclass(frozen=True)
class Impacts:
    """Impacts among the contacts of one geometry; see `fsm.interactions.contact.impacts`.

    Attributes
    ----------
    geometry : ContactGeometry
    normal : NormalForce
    mobility : (n_bodies, 3 or 6) array
        Inverse masses and moments of inertia; zero for fixed degrees of freedom.
    loose : (n_bodies,) bool array
        Bodies that can move and have no force element.
    coarse : -
        Factor of the steps within an impact, for a comparison with a less exact solution.
    """

    geometry: ContactGeometry
    normal: NormalForce
    mobility: np.ndarray
    loose: np.ndarray
    coarse: float = 1.0

    @property
    def resolved(self) -> bool:
        """Whether steps have to resolve any impacts."""
        return self.normal.law.restitution or bool(self.loose.any())

    @property
    def rules(self) -> ImpactRules:
        """Rules for the kernels."""
        restitution = self.normal.law.restitution
        steps = (_STEPS if restitution else _FEWER_STEPS) / self.coarse
        fast = _IMPACT_SPEED * self.normal.speed_floor
        loose = self.loose.astype(np.int64)
        return ImpactRules(self.mobility, loose, int(restitution), fast, float(self.normal.exponent), steps)

    def fraction_before(
        self,
        touching: ActiveContacts,
        measured: ContactKinematics,
        normal: np.ndarray,
        onset: np.ndarray,
        rates_before: np.ndarray,
        step: float,
    ) -> float:
        """Fraction of a step that ends before its impacts begin; 1 without impacts or if they begin gently."""
        return float(
            impacts.fraction_before(
                self.rules, measured.bodies, measured.gradient, touching.gap, measured.rate[:, 0].copy(), normal, onset,
                self._unit_energy(self.geometry.share[touching.slot]), rates_before, step,
            )
        )  # fmt: skip

    def longest_step(
        self, t: float, near: ActiveContacts, measured: ContactKinematics, kept: ContactMemory, rates: np.ndarray
    ) -> float:
        """Longest step that resolves present and imminent impacts among nearby slots, s."""
        return float(
            impacts.longest_step(
                self.rules, t, measured.bodies, measured.gradient, near.gap, measured.rate[:, 0].copy(), kept.onset,
                kept.began, self._unit_energy(self.geometry.share[near.slot]), rates,
            )
        )  # fmt: skip

    def young(self, age: np.ndarray, measured: ContactKinematics, onset: np.ndarray) -> np.ndarray:
        """Mask (count,) of contacts that may still be impacts, by their age (s) and initial closing speed (m/s)."""
        unit_energy = self._unit_energy(np.full(len(age), CORNER_WEIGHT))
        young = impacts.young_impacts(self.rules, age, measured.bodies, measured.gradient, onset, unit_energy)
        return np.asarray(young)

    def _unit_energy(self, share: np.ndarray) -> np.ndarray:
        """Energies (m,) at the depth 1 m, J."""
        return self.normal.law.energy(np.ones(len(share)), shared_weight(share), self.normal.params)
