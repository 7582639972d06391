"""Command `fsm export`."""

from __future__ import annotations

from pathlib import Path

import click

from fsm.cli.options import debug_option
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib


class _WithFormats(click.Command):
    """Command whose help lists all formats."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the formats with their descriptions."""
        from fsm.views.exporters import EXPORTERS

        with formatter.section("Formats"):
            formatter.write_dl([(name, EXPORTERS[name].text) for name in sorted(EXPORTERS)])


@click.command(cls=_WithFormats)
@click.argument("result", metavar="RESULT")
@click.option("--to", required=True, metavar="FORMAT", help="Format, see below.")
@click.option("--out", metavar="FILE", help="File to write; default: beside the result, result.FORMAT.")
@debug_option
def export(result: str, to: str, out: str | None) -> None:
    """Write a result for another program; RESULT is a folder of a run or its result.h5.

    A run of two stages and a table have several results. Each has its own file; with --out its name is added, for example
    FILE-deploy.
    """
    from fsm.results.find import find_results
    from fsm.results.store import read_solution

    with imports_outside_gc(), plain_matplotlib():
        from fsm.views.exporters import export as write
        from fsm.views.exporters import exporter_of, numbered

    exporter_of(to)
    found = find_results([result])
    target = _target(out)
    for name, path in found.items():
        file = path.with_name(f"{path.stem}.{to}") if target is None else numbered(target, name, len(found))
        click.echo(str(write(read_solution(path), to, file, str(path) if len(found) > 1 else result)))


def _target(out: str | None) -> Path | None:
    if out is None:
        return None
    if not out.strip():
        raise click.BadParameter(f'"{out}" is not the name of a file', param_hint="--out")
    if Path(out).is_dir():
        raise click.BadParameter(f"{out} is a folder; give the name of a file", param_hint="--out")
    return Path(out)
