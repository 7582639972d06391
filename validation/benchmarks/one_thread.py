"""Limits all libraries to one thread. This module must be imported before NumPy, because the libraries read these variables
only when they are loaded."""

from __future__ import annotations

import os

__all__ = ["VARIABLES"]

VARIABLES = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

for _name in VARIABLES:
    os.environ[_name] = "1"
