"""Commands `fsm study`, `fsm sensitivity`, `fsm solve-for` and `fsm optimise`."""

from __future__ import annotations

from pathlib import Path

import click

from fsm.cli.options import debug_option, drawing_options, figure_file, out_folder, set_option
from fsm.io.gc_startup import imports_outside_gc, plain_matplotlib

workers_option = click.option(
    "--workers", type=click.IntRange(min=1), metavar="N", help="Number of processes; default: one for each core."
)
_on_option = click.option(
    "--on", metavar="WHERE", help="Cluster: tcp://HOST:PORT of a Dask scheduler, or slurm; default: this machine."
)
_resume_option = click.option("--resume", is_flag=True, help="Keep the finished runs of an interrupted study or search.")


@click.command()
@click.argument("study", metavar="STUDY.toml")
@click.option("--out", required=True, metavar="DIR", help="Folder for the results.")
@set_option
@drawing_options
@workers_option
@_on_option
@_resume_option
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@debug_option
def study(
    study: str, out: str, overrides: tuple[str, ...], workers: int | None, on: str | None, resume: bool, quiet: bool
) -> None:
    """Vary parameters of a case within their ranges or scatter, and show which of them matters.

    STUDY.toml names the case, the parameters, the design of the runs and the responses; `fsm init study` writes one, and
    `fsm help study` explains its keys.
    """
    folder = out_folder(out)
    with imports_outside_gc():
        from fsm.studies.result import check_failed, result_lines
        from fsm.studies.study import run_study

    result = run_study(study, folder, overrides, workers, resume, not quiet, on=on)
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

    The peak force in quasi-static equilibrium (strips, sheets, films, beams) has exact derivatives, and so have the latch
    time and extremes of channels of wings and other mechanisms. A gradient costs one to four more runs. Others are
    differences of complete runs, four for each number, with their error.
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


@click.command("solve-for")
@click.argument("case", metavar="CASE.toml")
@click.option("--reach", required=True, metavar="RESPONSE=VALUE", help='Wanted value of a response, as "peak_force=5 N".')
@click.option("--by", required=True, metavar="PATH", help="Number of the case that is varied.")
@click.option("--between", required=True, nargs=2, metavar="A B", help="Two values of the number around the solution.")
@click.option("--out", required=True, metavar="DIR", help="Folder for the history and the solved case.")
@click.option(
    "--tolerance",
    type=click.FloatRange(1e-9, 0.1),
    default=1e-4,
    show_default=True,
    help="Relative difference from the value at which the search ends.",
)
@click.option("--runs", type=click.IntRange(min=3), default=40, show_default=True, help="Largest number of runs.")
@set_option
@_resume_option
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@debug_option
def solve_for(
    case: str,
    reach: str,
    by: str,
    between: tuple[str, str],
    out: str,
    tolerance: float,
    runs: int,
    overrides: tuple[str, ...],
    resume: bool,
    quiet: bool,
) -> None:
    """Find the value of a number of a case for which a response has a given value."""
    from fsm.case.loading.toml_file import read_toml

    folder = out_folder(out)
    with imports_outside_gc():
        from fsm.studies.solve_for import solve_for as find

    value, search = find(
        read_toml(case), Path(case), reach, by, between, folder, overrides, tolerance, runs, resume, not quiet
    )
    if not quiet:
        click.echo(f"{search.text({by: value})}; {len(search.points)} runs")
        click.echo(f"case: {folder / 'solved.toml'}")


@click.command()
@click.argument("file", metavar="OPTIMISE.toml")
@click.option("--out", required=True, metavar="DIR", help="Folder for the history and the case with the best values.")
@set_option
@_resume_option
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@debug_option
def optimise(file: str, out: str, overrides: tuple[str, ...], resume: bool, quiet: bool) -> None:
    """Minimise or maximise a response of a case by its numbers, under bounds of other responses.

    `fsm init optimise` writes a file, and `fsm help optimise` explains its keys.
    """
    folder = out_folder(out)
    with imports_outside_gc():
        from fsm.studies.optimise import optimise as find
        from fsm.studies.optimise import optimum_lines

    found = find(file, folder, overrides, resume, not quiet)
    if not quiet:
        for line in optimum_lines(found):
            click.echo(line)
        click.echo(f"case: {folder / 'solved.toml'}")
