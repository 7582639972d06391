"""Values that JSON can write."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def finite_values(data: Any) -> Any:
    """Data in types of JSON; numbers that are not finite become null."""
    if isinstance(data, dict):
        return {str(key): finite_values(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [finite_values(value) for value in data]
    if isinstance(data, np.ndarray):
        return finite_values(data.tolist())
    if isinstance(data, np.generic):
        return finite_values(data.item())
    return None if isinstance(data, float) and not math.isfinite(data) else data
