"""Tables of all channels: CSV and Parquet."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fsm.io.optional import optional_module
from fsm.results.all_channels import all_channels
from fsm.results.channel import write_channels_csv
from fsm.results.solution import Solution
from fsm.views.exporters.registry import exporter


@exporter("csv", "all channels, one row for each record; units in the headings")
def write_csv(solution: Solution, path: Path) -> None:
    """Write all channels with 12 significant digits; the first column is the time (s)."""
    write_channels_csv(all_channels(solution), {"time (s)": solution.time}, path)


@exporter("parquet", "all channels as columns in double precision; needs fsm[parquet]")
def write_parquet(solution: Solution, path: Path) -> None:
    """Write all channels; each column has its unit and description as metadata.

    Raises
    ------
    CaseError
        The package pyarrow is not installed.
    """
    arrow = optional_module("pyarrow", "the export to parquet", "parquet")
    parquet = optional_module("pyarrow.parquet", "the export to parquet", "parquet")
    fields, columns = [arrow.field("time", arrow.float64(), metadata={"unit": "s"})], [arrow.array(solution.time)]
    for channel in all_channels(solution).values():
        described = {"unit": channel.info.unit, "description": channel.info.text}
        for label, values in channel.columns.items():
            fields.append(arrow.field(label, arrow.float64(), metadata=described))
            columns.append(arrow.array(np.ascontiguousarray(values, dtype=float)))
    title = str(solution.layout.case.get("title", ""))
    table = arrow.Table.from_arrays(columns, schema=arrow.schema(fields, metadata={"title": title}))
    parquet.write_table(table, path)
