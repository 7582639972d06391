"""Command line. Each command imports only the large modules that it needs, so that all commands start quickly."""

from __future__ import annotations

import atexit
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fsm.calibrate.kinds import CALIBRATIONS
from fsm.cli import options as opt
from fsm.cli.export import export
from fsm.cli.help_key import help_key, schema
from fsm.cli.init import init
from fsm.cli.options import Command, Group
from fsm.cli.studies import optimise, sensitivity, solve_for, study
from fsm.errors import CaseError, ExpectationFailed
from fsm.io.gc_startup import import_numba, imports_outside_gc, plain_matplotlib, rare_gc
from fsm.io.interrupts import ignore_repeated_interrupts
from fsm.io.threads import one_thread

if TYPE_CHECKING:
    from fsm.run.table import Figures, Keep

EXIT_CODES = """
Exit codes: 0 done; 1 internal error; 2 wrong usage or case file; 3 not converged; 4 a number outside [expect];
5 energy balance outside its bound; 130 interrupted (continue with --resume).
"""


def spatial_option(command: Command) -> Command:
    """Add ``--spatial``."""
    text = "Use 6 degrees of freedom for each body, also for a planar motion."
    return click.option("--spatial", is_flag=True, help=text)(command)


def resume_option(command: Command) -> Command:
    """Add ``--resume``."""
    return click.option("--resume", is_flag=True, help="Continue an interrupted run from its checkpoint.")(command)


def method_option(command: Command) -> Command:
    """Add ``--method``."""
    text = "Integration method; replaces solve.method of the case."
    return click.option("--method", metavar="NAME", help=text)(command)


def _version(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        import fsm

        click.echo(f"fsm {fsm.__version__}")
        ctx.exit()


@click.group(cls=Group, epilog=EXIT_CODES, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version, help="Show the version.")
@opt.debug_option
def cli() -> None:
    """Deployment of folded strips, sheets, wings and scissor arrays; vibration of films; mechanisms and scenes of bodies."""


@cli.command()
@click.argument("case", metavar="CASE.toml")
@click.option("--out", required=True, metavar="DIR", help="Folder for the results.")
@opt.set_option
@spatial_option
@method_option
@resume_option
@click.option("--watch", is_flag=True, help="Serve a page on this computer that follows the run.")
@click.option(
    "--figures",
    type=click.Choice(["none", "all"]),
    default="all",
    show_default=True,
    help="Whether figures are drawn. `fsm plot` draws them later.",
)
@opt.drawing_options
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@opt.debug_option
def run(
    case: str,
    out: str,
    overrides: tuple[str, ...],
    spatial: bool,
    method: str | None,
    resume: bool,
    watch: bool,
    figures: str,
    quiet: bool,
) -> None:
    """Solve a case and write its results and plots."""
    with imports_outside_gc():
        from fsm.case.loading.load_case import load_case

    settings = [*overrides, *_solve_overrides(spatial, method)]
    loaded = load_case(case, settings)
    folder, drawn = opt.out_folder(out), figures == "all"

    with imports_outside_gc():
        from fsm.views.plots.figures import drawn_beside

    shown = _watched(folder, loaded.case.title or case) if watch else nullcontext(not quiet)
    try:
        with drawn_beside() if drawn else nullcontext():
            with imports_outside_gc():
                import_numba()
                from fsm.run.compile_beside import compiled_beside
                from fsm.run.run_case import run_case

            with compiled_beside(["--case", case, *settings]), opt.add_source(case), shown as progress:
                summary = run_case(loaded, folder, progress=progress, resume=resume, figures=drawn)
    except ExpectationFailed:  # the run itself is complete and its files are written
        if not quiet:
            from fsm.results.summary_file import SUMMARY, read_summary
            from fsm.run.summary_text import summary_lines

            opt.say(summary_lines(read_summary(folder / SUMMARY), folder))
        raise
    if not quiet:
        from fsm.run.summary_text import summary_lines

        opt.say(summary_lines(summary, folder))


@cli.command()
@click.argument("tables", metavar="TABLE.csv", nargs=-1, required=True)
@click.option("--out", required=True, metavar="DIR", help="Folder for the results; with --keep all one folder for each row.")
@opt.set_option
@opt.drawing_options
@click.option("--workers", type=click.IntRange(min=1), metavar="N", help="Number of processes; default: one for each core.")
@click.option("--on", metavar="WHERE", help="Cluster: tcp://HOST:PORT of a Dask scheduler, or slurm; default: this machine.")
@click.option("--part", metavar="K/N", help="Run the Kth of N parts of the table; --merge joins them.")
@click.option("--merge", is_flag=True, help="Join the results of parts: fsm table --merge DIR... --out DIR.")
@click.option(
    "--keep",
    type=click.Choice(["all", "none"]),
    help="Rows that keep a folder with all files; default: all, and none on a cluster or above 500 rows.",
)
@click.option(
    "--figures",
    type=click.Choice(["none", "first", "all"]),
    default="none",
    show_default=True,
    help="Rows whose figures are drawn, and the peak over each parameter. `fsm plot` draws figures of a row later.",
)
@method_option
@resume_option
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@opt.debug_option
def table(
    tables: tuple[str, ...],
    out: str,
    overrides: tuple[str, ...],
    workers: int | None,
    on: str | None,
    part: str | None,
    merge: bool,
    keep: Keep | None,
    figures: Figures,
    method: str | None,
    resume: bool,
    quiet: bool,
) -> None:
    """Solve every row of a table of cases, on all cores or on a cluster.

    The columns of the table are dotted paths into a base case, case.toml beside it.
    """
    from fsm.run.table import MOST_FOLDERS, failures, merge_tables, part_of, run_table
    from fsm.run.table_files import format_comparison, format_table

    folder = opt.out_folder(out)
    if merge:
        if part is not None:
            raise click.UsageError("--merge joins parts that have run; leave --part out")
        rows, missing = merge_tables([Path(name) for name in tables], folder)
    elif len(tables) > 1:
        raise click.UsageError(f"{len(tables)} tables are given; give one, or --merge for folders of parts")
    else:
        shown = not quiet
        parts, missing = part_of(part), 0
        rows = run_table(tables[0], folder, overrides, workers, resume, method, shown, figures, keep, on, parts)
    if not quiet:
        click.echo(format_table(list(rows[:MOST_FOLDERS])))
        if len(rows) > MOST_FOLDERS:
            click.echo(f"and {len(rows) - MOST_FOLDERS:,} more rows in summary.csv")
        if not merge:
            opt.say(format_comparison(tables[0], rows).splitlines())
        click.echo(f"results: {folder}")
    failed = [row for row in rows if row.get("error")]
    if failed:
        lines = [f"{row['case']}: {line}" for row in failed for line in row["error"].splitlines()]
        opt.end_with([*(lines if quiet else []), f"{len(failed)} of {len(rows)} cases failed"], failures(failed))
    if missing:
        opt.end_with([f"{missing} rows of the table are in no part; run them, and merge again"], 3)


@cli.command()
@click.argument("case", metavar="CASE.toml")
@click.option("--out", metavar="FILE.png", help="Also draw the mechanism with its joints: a file (.png, .svg, .pdf).")
@opt.set_option
@spatial_option
@opt.debug_option
def check(case: str, out: str | None, overrides: tuple[str, ...], spatial: bool) -> None:
    """Check a case and describe its model, without solving it."""
    from fsm.case.loading.load_case import load_case

    loaded = load_case(case, [*overrides, *_solve_overrides(spatial, None)])

    with imports_outside_gc():
        from fsm.check.report import describe

    with opt.add_source(case):
        lines = describe(loaded.case)
    opt.say(lines)
    if out is not None:
        with imports_outside_gc(), plain_matplotlib():
            from fsm.views.pictures.mechanism_picture import draw_mechanism
        with opt.add_source(case):
            draw_mechanism(loaded.case, Path(out))
        click.echo(out)


@cli.command()
@click.argument("case", metavar="CASE.toml")
@click.option("--out", required=True, metavar="FILE.gif", help="Animation to write; for a sheet FILE.png, .svg or .pdf.")
@opt.set_option
@opt.debug_option
def preview(case: str, out: str, overrides: tuple[str, ...]) -> None:
    """Animate the deployment with rigid panels: fast, but only approximate. For a sheet, draw the crease pattern
    instead; places of faults are red.
    """
    from fsm.case.loading.load_case import load_case

    try:
        loaded = load_case(case, overrides)
    except CaseError as error:
        _draw_pattern_fault(error, Path(out))
        raise
    if loaded.case.sheet is not None:
        with imports_outside_gc(), plain_matplotlib():
            from fsm.views.pictures.sheet_picture import draw_sheet
        with opt.add_source(case):
            notes = draw_sheet(loaded.case, Path(out))
        for note in notes:
            click.echo(note, err=True)
        click.echo(out)
        return

    with imports_outside_gc(), plain_matplotlib():
        from fsm.views.pictures.preview import preview as animate

    with opt.add_source(case):
        notes = animate(loaded.case, Path(out))
    for note in notes:
        click.echo(note, err=True)
    click.echo(out)


def _draw_pattern_fault(error: CaseError, out: Path) -> None:
    """Draw the pattern file of a case that is faulty, if the fault has places."""
    causes = [fault.cause for fault in error.faults if fault.cause is not None]
    if causes:
        with imports_outside_gc(), plain_matplotlib():
            from fsm.views.pictures.sheet_picture import draw_fault
        draw_fault(causes[0], out)


@cli.command()
@click.argument("result", metavar="RESULT")
@click.option(
    "--out",
    metavar="DIR|FILE",
    help="Folder for the plots, or a file (.png, .svg, .pdf) for one of them: the figure of this name, as motion.png, "
    "else the first one; default: the folder of the result.",
)
@click.option("--channel", "channels", multiple=True, metavar="PATTERN", help="Draw only these channels, into channels.png.")
@click.option("--over-time", is_flag=True, help="Draw channels over time, even if there is a drive.")
@opt.drawing_options
@opt.debug_option
def plot(result: str, out: str | None, channels: tuple[str, ...], over_time: bool) -> None:
    """Draw the figures of a result again, or some of its channels.

    RESULT is a results file, or the folder of a run.
    """
    from fsm.results.store import read_solution

    if over_time and not channels:
        raise click.UsageError("--over-time is for --channel only")
    target = None if out is None else opt.figure_file(out)
    file = Path(result) / "result.h5" if Path(result).is_dir() else Path(result)
    folder = file.parent if out is None else opt.out_folder(out) if target is None else target.parent
    solution = read_solution(file)
    folder.mkdir(parents=True, exist_ok=True)

    with imports_outside_gc(), plain_matplotlib():
        from fsm.views.plots.channels import plot_channels  # this imports Matplotlib
        from fsm.views.plots.drawing import file_format
        from fsm.views.plots.figures import draw, draw_one

    if channels:
        path = target or (folder / "channels").with_suffix(file_format())
        with opt.add_source(result):
            plot_channels(solution, channels, path, over_time)
        click.echo(str(path))
    elif target is not None:
        click.echo(f"{target}: {draw_one(solution, target)}")
    else:
        for path in draw(solution, folder):
            click.echo(str(path))


@cli.command()
@click.argument("results", metavar="RESULT...", nargs=-1, required=True)
@click.option("--out", required=True, metavar="FILE.html", help="Page to write.")
@click.option("--title", default="", metavar="TEXT", help="Title of the page; default: the title of the case.")
@click.option("--channel", "channels", multiple=True, metavar="PATTERN", help="Always include these channels.")
@opt.debug_option
def report(results: tuple[str, ...], out: str, title: str, channels: tuple[str, ...]) -> None:
    """Write results as one interactive page that works offline: motion, curves, and tables.

    RESULT is a results file, the folder of a run, or the folder of a table. Several results are compared.
    """
    with imports_outside_gc(), plain_matplotlib():
        from fsm.views.report.write import write_report

    click.echo(str(write_report(results, out, channels, title)))


@cli.command()
@click.argument("results", metavar="RESULT...", nargs=-1, required=True)
@opt.debug_option
def view(results: tuple[str, ...]) -> None:
    """Write the page of results into a temporary folder, and open it in the browser."""
    import tempfile
    import webbrowser

    with imports_outside_gc(), plain_matplotlib():
        from fsm.views.report.write import write_report

    page = write_report(results, Path(tempfile.mkdtemp(prefix="fsm-view-")) / "report.html")
    click.echo(str(page))
    if not webbrowser.open(page.resolve().as_uri()):
        click.echo("no browser was found; open the file above in a browser", err=True)


@cli.command()
@click.argument("kind", metavar="KIND", type=click.Choice(list(CALIBRATIONS)))
@click.argument("data", metavar="DATA")
@click.option("--out", required=True, metavar="DIR", help="Folder for the results.")
@click.option(
    "--fit",
    type=click.Choice(["smooth", "interpolate", "monotone"]),
    default="smooth",
    show_default=True,
    help="Curves through measured points: smoothed by cross-validation, interpolated, or monotone.",
)
@click.option("--without-flagged", is_flag=True, help="Leave out rows that are flagged as outliers.")
@click.option(
    "--level",
    type=click.FloatRange(0.5, 0.9999),
    default=0.95,
    show_default=True,
    help="Confidence level of intervals.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the random numbers.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@opt.debug_option
def calibrate(kind: str, data: str, out: str, fit: str, without_flagged: bool, level: float, seed: int, quiet: bool) -> None:
    """Identify parameters and their intervals from measured data; KIND is one of {kinds}.

    DATA is a CSV file with units in its headings (docs/calibration.md). The command writes calibration.json, plots, and
    files for use in a case.
    """
    import importlib

    folder = opt.out_folder(out)
    module, function = CALIBRATIONS[kind].split(":")

    with imports_outside_gc():
        from fsm.calibrate.report import Options, table_lines, write_calibration

        calibration = importlib.import_module(module)

    options = Options(fit, without_flagged, level, seed, not quiet)
    found = getattr(calibration, function)(Path(data), options)
    write_calibration(found, folder, options)
    if not quiet:
        opt.say([*table_lines(found, options), f"results  {folder}"])


calibrate.help = (calibrate.help or "").format(kinds=", ".join(CALIBRATIONS))


@cli.command()
@opt.debug_option
def warmup() -> None:
    """Compile all kernels now, so that the first run starts faster."""
    with imports_outside_gc():
        from fsm.run.warm_up import compile_ahead

    compile_ahead()


for _command in (export, help_key, init, schema, optimise, sensitivity, solve_for, study):
    cli.add_command(_command)


def _solve_overrides(spatial: bool, method: str | None) -> list[str]:
    return [*(["solve.spatial=true"] if spatial else []), *([f"solve.method={method}"] if method else [])]


@contextmanager
def _watched(folder: Path, title: str) -> Iterator[Callable[[float], None]]:
    """Page of a run on the loopback address; yields the function that receives the completed fraction."""
    with imports_outside_gc(), plain_matplotlib():
        from fsm.views.report.watch import Watch

    with Watch(folder, title) as page:
        click.echo(f"watch       {page.address}", err=True)
        yield page.progress


def _open_closed_streams() -> None:
    """Direct a closed output to the null device; otherwise the next file that is opened would receive the messages."""
    for number, name in ((0, "stdin"), (1, "stdout"), (2, "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free number, which is this one
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115


def _end_process(ending: SystemExit) -> None:
    """End the process without deleting its modules and objects one by one, which takes 30 ms.

    Functions that are registered for the end of the process are called. Return if other threads run, if the output cannot be
    written, or if there is no exit code: Python then ends the process.
    """
    threads = [thread for thread in threading.enumerate() if thread is not threading.main_thread() and not thread.daemon]
    code = 0 if ending.code is None else ending.code
    if threads or not isinstance(code, int):
        return
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        return
    atexit._run_exitfuncs()
    os._exit(code & 0xFF)


def main() -> None:
    """Run the command ``fsm``."""
    _open_closed_streams()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # their search reads the data of all installed packages
    try:
        with ignore_repeated_interrupts(), rare_gc(), one_thread():
            cli(prog_name="fsm")
    except KeyboardInterrupt:  # the interrupt came before or after the command itself
        sys.exit(130)
    except SystemExit as ending:
        _end_process(ending)
        raise
