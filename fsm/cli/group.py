"""Group of commands: errors become lines and exit codes."""

from __future__ import annotations

import errno
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import click

from fsm.cli.options import debugging
from fsm.errors import CaseError, FsmError, OutOfMemory, is_interrupt


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
