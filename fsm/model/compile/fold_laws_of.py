"""Laws of the folds of flexible facets and of bars from their data."""

from __future__ import annotations

import numpy as np

from fsm.case.models.flexible_facets import FoldData
from fsm.kernels.programs import CONSTANT, ramp
from fsm.laws.crease import CreaseLaws, join_curves, openings_of
from fsm.laws.crease_sliders import Sliders, new_sliders
from fsm.model.elements.crease_curves import curve_of, hysteresis_of
from fsm.model.elements.element_angles import side_of
from fsm.model.nodes.facets.folds import FoldLaws


def fold_laws_of(data: FoldData) -> FoldLaws:
    """Laws of folds; all folds of one crease of the pattern open to the same side.

    Raises
    ------
    CaseError
        A measured curve is faulty.
    """
    table = join_curves([curve_of(law) for law in data.laws])
    side = np.array([side_of(start, rest) for start, rest in zip(data.start.tolist(), data.rest.tolist(), strict=True)])
    curves = CreaseLaws(
        side * data.rest, side, np.zeros(len(side)), data.law, table.bounds, table.knots, table.coefficients, table.energies
    )
    sliders, chosen = _sliders(data, curves)
    end = CONSTANT if data.end is None else ramp(data.end)
    return FoldLaws(
        data.start, curves, data.share, data.damping, data.turning, end, data.linear_to, data.rise, sliders, chosen
    )


def _sliders(data: FoldData, curves: CreaseLaws) -> tuple[Sliders | None, np.ndarray]:
    """Sliders of laws with two branches, and the folds that have them."""
    found = [hysteresis_of(law) for law in data.laws]
    known = [number for number, hysteresis in enumerate(found) if hysteresis is not None]
    chosen = np.flatnonzero(np.isin(data.law, known))
    if not len(chosen):
        return None, chosen
    which = np.searchsorted(known, data.law[chosen])
    laws = [hysteresis for hysteresis in found if hysteresis is not None]
    opening = openings_of(curves, chosen, data.start)
    stiffness = np.array([law.stiffness for law in laws])[which]
    return new_sliders(opening, stiffness, which.astype(np.int64), join_curves([law.strength for law in laws])), chosen
