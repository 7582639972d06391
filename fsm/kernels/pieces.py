"""Functions of time (`fsm.kernels.programs`) in kernels."""

from __future__ import annotations

import numpy as np

from fsm.kernels import programs
from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.jit import kernel, shared
from fsm.kernels.programs import Pieces

program_at = shared(programs.program_at)


@kernel
def pieces_at(t: np.ndarray, k: int) -> Pieces:
    """Pieces in a table of `fsm.kernels.addresses`, from row k on."""
    return Pieces(integers_1d(t, k), floats_1d(t, k + 1), integers_1d(t, k + 2), floats_2d(t, k + 3))
