"""Options and functions that commands share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

from fsm.errors import CaseError
from fsm.views.plots.drawing import FORMATS, STYLES, drawing

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
