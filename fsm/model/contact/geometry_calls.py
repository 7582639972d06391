"""Kernels of a geometry by their addresses, which its table holds; see `GeometryKernels`."""

from __future__ import annotations

from functools import cache

import numpy as np

from fsm.kernels.kernels_in import addresses_of, kernels_in
from fsm.kernels.tables import TableExample
from fsm.model.bodies.contact_arrays import ContactArrays, GeometryKernels


def _arguments() -> GeometryKernels:
    """Examples of the arguments of each kernel of a geometry."""
    g, whole = TableExample(ContactArrays), np.zeros(0, dtype=np.int64)
    two, three = np.zeros((0, 0)), np.zeros((0, 0, 0))
    return GeometryKernels(
        (g, two), (g, two, 0.0), (g, two, two, 0), (g, whole), (g, two, 0), (g, two, two, 0, three, three), (g, two),
        (g, two, whole, True),
    )  # fmt: skip


def _examples() -> tuple[GeometryKernels, GeometryKernels]:
    weights = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0, 0))
    return GeometryKernels(0, 0, None, None, weights, None, 0, None), _arguments()


@cache
def calls_of(kernels: GeometryKernels) -> np.ndarray:
    """Addresses (8,) of the kernels of a geometry."""
    return addresses_of(kernels, _arguments())


geometry_of = kernels_in(GeometryKernels, _examples)
"""Kernels of the geometry of a table, in kernels."""
