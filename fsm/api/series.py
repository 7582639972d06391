"""Channel of a result with its times, for arithmetic and plots."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from fsm.results.channel import Channel


class Series(NDArrayOperatorsMixin):
    """Quantity over time. A series behaves like the array of its values in arithmetic, in NumPy functions and in plots.

    Attributes
    ----------
    name : str
    unit : str
        SI unit.
    text : str
        Description.
    time : (n,) array, s
    values : (n, ...) array
        The first axis is time; the others are those of `dims`.
    dims : dict
        Labels or coordinates of the other axes, by name.

    Examples
    --------
    >>> import fsm
    >>> result = fsm.load("folding_cases/rotating_squares/case.toml").set("drive.0.travel", 0.14).run()
    >>> force = result["drive.1.force"]
    >>> force.unit, force.values.shape == force.time.shape, bool(force.max() > 0)
    ('N', True, True)
    """

    def __init__(self, channel: Channel, time: np.ndarray) -> None:
        self.name = channel.info.name
        self.unit = channel.info.unit
        self.text = channel.info.text
        self.dims = {dim.name: dim.labels for dim in channel.info.dims}
        self.time = time
        self.values = np.asarray(channel.values)
        self._columns = channel.columns

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Components by label, (n,) each."""
        return self._columns

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        plain = [each.values if isinstance(each, Series) else each for each in inputs]
        return getattr(ufunc, method)(*plain, **kwargs)

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, index: Any) -> Any:
        return self.values[index]

    def min(self, axis: int | None = None, out: Any = None) -> Any:
        """Smallest value; NaN values, which mean no contact, are ignored."""
        return np.nanmin(self.values, axis=axis, out=out)

    def max(self, axis: int | None = None, out: Any = None) -> Any:
        """Largest value; NaN values, which mean no contact, are ignored."""
        return np.nanmax(self.values, axis=axis, out=out)

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.values.shape))
        if not np.isfinite(self.values).any():
            return f"Series({self.name!r}: {shape} values, {self.unit})"
        return f"Series({self.name!r}: {shape} values from {self.min():.4g} to {self.max():.4g} {self.unit})"
