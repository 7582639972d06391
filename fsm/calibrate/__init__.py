"""Calibration: parameters with intervals from test data, and predictions with uncertainty bands.

In Python this package can also be called as a function: ``found = fsm.calibrate("crease", "creases.csv")``; see
`fsm.api.calibration.calibrate`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any


class _Calibrate(ModuleType):
    """Package that can be called, because a function of the interface has the same name."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """See `fsm.api.calibration.calibrate`."""
        return import_module("fsm.api.calibration").calibrate(*arguments, **options)


sys.modules[__name__].__class__ = _Calibrate
