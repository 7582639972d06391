"""Commands `fsm study`, `fsm sensitivity`, `fsm solve-for` and `fsm optimise`."""

from __future__ import annotations

import click

from fsm.cli.options import debug_option, drawing_options, out_folder, set_option
from fsm.io.gc_startup import imports_outside_gc

workers_option = click.option(
    "--workers", type=click.IntRange(min=1), metavar="N", help="Number of processes; default: one for each core."
)
_resume_option = click.option("--resume", is_flag=True, help="Keep the finished runs of an interrupted study or search.")


@click.command()
@click.argument("study", metavar="STUDY.toml")
@click.option("--out", required=True, metavar="DIR", help="Folder for the results.")
@set_option
@drawing_options
@workers_option
@_resume_option
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@debug_option
def study(study: str, out: str, overrides: tuple[str, ...], workers: int | None, resume: bool, quiet: bool) -> None:
    """Vary parameters of a case within their ranges or scatter, and show which of them matters.

    STUDY.toml names the case, the parameters, the design of the runs and the responses; `fsm init study` writes one, and
    `fsm help study` explains its keys.
    """
    folder = out_folder(out)
    with imports_outside_gc():
        from fsm.studies.result import check_failed, result_lines
        from fsm.studies.study import run_study

    result = run_study(study, folder, overrides, workers, resume, not quiet)
    if not quiet:
        for line in [*result_lines(result), f"page: {folder / 'report.html'}"]:
            click.echo(line)
    check_failed(result)
