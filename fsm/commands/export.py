"""Command `fsm export`."""

from __future__ import annotations

from pathlib import Path

import click

from fsm.cli_options import debug_option
from fsm.errors import CaseError
from fsm.gc_startup import imports_outside_gc, plain_matplotlib

__all__ = ["export"]

class _WithFormats(click.Command):
    """Command whose help lists all formats."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the formats with their descriptions."""
        from fsm.exporters import EXPORTERS

        with formatter.section("Formats"):
            formatter.write_dl([(name, EXPORTERS[name].text) for name in sorted(EXPORTERS)])


@click.command(cls=_WithFormats)
@click.argument("result", metavar="RESULT")
@click.option("--to", required=True, metavar="FORMAT", help="Format, see below.")
@click.option("--out", metavar="FILE", help="File to write; default: beside the result, result.FORMAT.")
@debug_option
def export(result: str, to: str, out: str | None) -> None:
    """Write a result for another program; RESULT is a folder of a run or its result.h5."""
    from fsm.results.store import read_solution

    with imports_outside_gc(), plain_matplotlib():
        from fsm.exporters import export as write
        from fsm.exporters import exporter_of

    exporter_of(to)
    path = Path(result)
    if path.is_dir():
        stages = [str(path / name / "result.h5") for name in ("deploy", "vibrate") if (path / name / "result.h5").is_file()]
        if stages:
            raise CaseError(f"is a run of two stages; give {' or '.join(stages)}", result)
        path = path / "result.h5"
    target = _target(path, to, out)
    click.echo(str(write(read_solution(path), to, target, result)))


def _target(path: Path, to: str, out: str | None) -> Path:
    if out is None:
        return path.with_name(f"{path.stem}.{to}")
    if not out.strip():
        raise click.BadParameter(f'"{out}" is not the name of a file', param_hint="--out")
    if Path(out).is_dir():
        raise click.BadParameter(f"{out} is a folder; give the name of a file", param_hint="--out")
    return Path(out)
