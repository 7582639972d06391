"""Options and functions that commands share, and their group: errors become lines and exit codes."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import click

from fsm.errors import CaseError, FsmError, OutOfMemory, is_interrupt
from fsm.views.plots.drawing import FORMATS, STYLES, drawing


@contextmanager
def _one_line(root: click.Context | None = None) -> Iterator[None]:
    """Report a wrong word of the command line in one line; a command without words shows its help."""
    try:
        yield
    except click.exceptions.NoArgsIsHelpError:
        raise
    except click.UsageError as error:
        inner = root.invoked_subcommand if root is not None else None
        command = error.ctx.command_path if error.ctx is not None else f"fsm {inner or ''}".rstrip()
        text = error.format_message().rstrip(".")
        end_with(
            [f"{command}: {text[:1].lower()}{text[1:]}; `{command} --help` lists arguments and options"], error.exit_code
        )


class Group(click.Group):
    """Group of commands that end with an exit code and one line for each mistake, never with a traceback."""

    def make_context(self, *arguments: Any, **extra: Any) -> click.Context:
        """Read the words before the name of a command."""
        with _one_line():
            return super().make_context(*arguments, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command and report its errors."""
        try:
            with _one_line(ctx):
                return super().invoke(ctx)
        except (click.exceptions.Exit, click.ClickException, click.Abort):
            raise
        except KeyboardInterrupt:
            end_with(["interrupted"], 130)
        except FsmError as error:
            _trace(ctx)
            end_with(error.lines() if isinstance(error, CaseError) else str(error).splitlines(), error.exit_code)
        except OSError as error:
            if error.errno == errno.EPIPE:  # `fsm check ... | head` closes the pipe; click then ends without a message
                raise
            _trace(ctx)
            end_with([_file_error(error)], 2)
        except Exception as error:
            if is_interrupt(error):
                end_with(["interrupted"], 130)
            _trace(ctx)
            if isinstance(error, MemoryError):
                end_with([str(OutOfMemory(error))], OutOfMemory.exit_code)
            hint = "" if debugging(ctx) else "; repeat the command with --debug and report its output to the developers"
            text = " ".join(str(error).split())
            end_with([f"internal error: {type(error).__name__}: {text}{hint}"], 1)


def say(lines: Iterable[str]) -> None:
    """Print lines."""
    for line in lines:
        click.echo(line)


def end_with(lines: list[str], code: int) -> NoReturn:
    """Print lines on standard error and end the command with an exit code."""
    for line in lines:
        click.echo(line, err=True)
    raise click.exceptions.Exit(code)


def _trace(ctx: click.Context) -> None:
    if debugging(ctx):
        import traceback

        click.echo(traceback.format_exc(), err=True)


def _file_error(error: OSError) -> str:
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}" if error.filename else reason


_OTHER_FORMATS = (".jpg", ".jpeg", ".gif", ".tif", ".tiff", ".eps", ".bmp", ".webp", ".ps")
"""Suffixes of pictures that figures cannot have."""

Command = TypeVar("Command", bound=Callable[..., Any])


def debugging(ctx: click.Context) -> bool:
    """Whether the option ``--debug`` is set."""
    return bool(ctx.meta.get("fsm.debug"))


def _debug(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value:
        ctx.meta["fsm.debug"] = True


def debug_option(command: Command) -> Command:
    """Add ``--debug``."""
    text = "Show the traceback of an error."
    return click.option("--debug", is_flag=True, expose_value=False, callback=_debug, help=text)(command)


def set_option(command: Command) -> Command:
    """Add ``--set``."""
    text = 'Override a value, e.g. strip.fold_angle="75 deg"; the value none removes the key.'
    return click.option("--set", "overrides", multiple=True, metavar="PATH=VALUE", help=text)(command)


def drawing_options(command: Command) -> Command:
    """Add ``--style`` and ``--format``, for all figures that the command draws."""

    @wraps(command)
    def drawn(*arguments: Any, style: str, file_format: str, **options: Any) -> Any:
        with drawing(style, f".{file_format}", two=True):
            return command(*arguments, **options)

    formats = [suffix.removeprefix(".") for suffix in FORMATS]
    text = "File format of figures."
    add_format = click.option(
        "--format", "file_format", type=click.Choice(formats), default="png", show_default=True, help=text
    )
    text = "Figures for a printed page, or with larger letters and thicker lines for a projected slide."
    add_style = click.option("--style", type=click.Choice(list(STYLES)), default="paper", show_default=True, help=text)
    return add_style(add_format(drawn))  # type: ignore[return-value]


@contextmanager
def add_source(source: str) -> Iterator[None]:
    """Add the name of the case file to faults from the compiler, which has no access to this name."""
    try:
        yield
    except CaseError as error:
        if error.source or not all(fault.path for fault in error.faults):
            raise
        raise CaseError(error.faults, source) from error


def figure_file(out: str) -> Path | None:
    """File of a figure, if `out` ends in the suffix of one; None for the name of a folder."""
    path = Path(out)
    if path.is_dir() or path.suffix.lower() not in (*FORMATS, *_OTHER_FORMATS):
        return None
    if path.suffix.lower() in _OTHER_FORMATS:
        text = f"{out}: figures have the formats {', '.join(FORMATS)}; give one of them, or the name of a folder"
        raise click.BadParameter(text, param_hint="--out")
    return path


def out_folder(out: str) -> Path:
    """Folder for results; it is not created here."""
    if not out.strip():
        text = f'"{out}" is not the name of a folder; give a name, or . for the current folder'
        raise click.BadParameter(text, param_hint="--out")
    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise click.BadParameter(f"{out} is a file; give the name of a folder", param_hint="--out")
    return folder
