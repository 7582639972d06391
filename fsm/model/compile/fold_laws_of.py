"""Laws of the folds of flexible facets and of bars from their data."""

from __future__ import annotations

import numpy as np

from fsm.case.models.flexible_facets import FoldData
from fsm.kernels.programs import CONSTANT, ramp
from fsm.laws.crease import CreaseLaws, join_curves
from fsm.model.elements.crease_curves import curve_of, hysteresis_of, sliders_of_laws
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
    sliders, chosen = sliders_of_laws([hysteresis_of(law) for law in data.laws], curves, data.start)
    end = CONSTANT if data.end is None else ramp(data.end)
    return FoldLaws(
        data.start, curves, data.share, data.damping, data.turning, end, data.linear_to, data.rise, sliders, chosen
    )
