"""Commands `fsm study`, `fsm sensitivity`, `fsm solve-for` and `fsm optimise`."""

from __future__ import annotations

from pathlib import Path

import click

from fsm.cli.options import debug_option, drawing_options, figure_file, out_folder, set_option
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib

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


@click.command()
@click.argument("case", metavar="CASE.toml")
@click.option(
    "--of", default="peak_force", show_default=True, metavar="RESPONSE", help='Number of the summary, or "max of CHANNEL".'
)
@click.option("--by", default="", metavar="PATH,PATH,...", help="Numbers of the case; default: the parameters of --study.")
@click.option(
    "--study",
    "scatter",
    metavar="STUDY.toml",
    help="Study with the scatter of the numbers; gives that of the response.",
)
@click.option("--out", metavar="FILE.png", help="Also draw a tornado.")
@set_option
@workers_option
@debug_option
def sensitivity(
    case: str, of: str, by: str, scatter: str | None, out: str | None, overrides: tuple[str, ...], workers: int | None
) -> None:
    """Differentiate a response with respect to numbers of a case.

    The peak force of strips, lattices and rigid sheets in quasi-static equilibrium has exact derivatives, for little more
    than the cost of a run. Others are differences of complete runs, four for each number, with their error.
    """
    from fsm.case.loading.toml_file import read_toml

    target = None if out is None else figure_file(out)
    if out is not None and target is None:
        raise click.BadParameter(f"{out} is no figure; give a name that ends in .png, .svg or .pdf", param_hint="--out")
    with imports_outside_gc(), plain_matplotlib():
        from fsm.studies.sensitivity import draw_sensitivity, sensitivity_lines
        from fsm.studies.sensitivity import sensitivity as find

    paths = [path.strip() for path in by.split(",") if path.strip()]
    found = find(read_toml(case), Path(case), of, paths, overrides, Path(scatter) if scatter else None, workers)
    for line in sensitivity_lines(found):
        click.echo(line)
    if target is not None:
        draw_sensitivity(found, target)
        click.echo(str(target))
