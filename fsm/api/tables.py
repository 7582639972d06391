"""Results as a dataset of xarray or a data frame of pandas."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from fsm.io.optional import optional_module
from fsm.results.all_channels import all_channels
from fsm.results.solution import Solution

if TYPE_CHECKING:
    import pandas
    import xarray


def to_xarray(solution: Solution) -> xarray.Dataset:
    """All channels and the shape over time.

    Returns
    -------
    xarray.Dataset
        One variable for each channel, and ``shape`` (time, plate, corner, axis), m. Variables have the attributes `units`
        and `long_name`. Dimensions have their labels or coordinates.

    Raises
    ------
    CaseError
        The package xarray is not installed.
    """
    xr = optional_module("xarray", "to_xarray", "tables")
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"time": ("time", solution.time, {"units": "s", "long_name": "time"})}
    for name, channel in all_channels(solution).items():
        for dim in channel.info.dims:
            coordinates[dim.name] = (dim.name, list(dim.labels), {"units": dim.unit, "long_name": dim.text})
        dims = ("time", *(dim.name for dim in channel.info.dims))
        variables[name] = (dims, channel.values, {"units": channel.info.unit, "long_name": channel.info.text})
    if solution.shape.size:
        text = {"units": "m", "long_name": "corner points of the plates"}
        variables["shape"] = (("time", "plate", "corner", "axis"), solution.shape, text)
        coordinates["axis"] = ("axis", ["x", "y", "z"], {"units": "1", "long_name": "inertial axis"})
        coordinates["panel"] = ("plate", solution.layout.panel, {"units": "1", "long_name": "panel of the plate"})
    title = solution.layout.case.get("title", "")
    return xr.Dataset(variables, coordinates, {"title": title, **_plain(solution.summary)})


def to_pandas(solution: Solution, names: Iterable[str] | None = None) -> pandas.DataFrame:
    """Channels as columns with the time (s) as index.

    Parameters
    ----------
    solution : Solution
    names : names of channels; None for all

    Returns
    -------
    pandas.DataFrame
        ``attrs["units"]`` has the unit of each column.

    Raises
    ------
    CaseError
        The package pandas is not installed.
    """
    pd = optional_module("pandas", "to_pandas", "tables")
    columns, units = {}, {}
    channels = all_channels(solution)
    for name in channels if names is None else names:
        for label, values in channels[name].columns.items():
            columns[label], units[label] = values, channels[name].info.unit
    frame = pd.DataFrame(columns, index=pd.Index(solution.time, name="time (s)"))
    frame.attrs["units"] = units
    return frame


def _plain(summary: dict[str, Any]) -> dict[str, Any]:
    """Numbers and texts of a summary, which an attribute can hold."""
    return {key: value for key, value in summary.items() if isinstance(value, int | float | str | np.number)}
