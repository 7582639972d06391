"""Reading of TOML texts: their tables, or one message with the line of the fault."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fsm.errors import CaseError, Fault
from fsm.io.input_file import read_failure, read_input_file

DEEPEST = 40
"""Largest nesting depth of lists and sections; cases have fewer than ten levels."""
_TOO_DEEP = f"lists or sections are nested more than {DEEPEST} levels deep; a case needs fewer than 10 levels"
_MOST_TEXT = 16 * 2**20
"""Largest size of a case file, bytes; enough for 50,000 bodies."""
_WORD = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-])(?:{_WORD}[ \t]*+\.[ \t]*+){{{DEEPEST}}}")
"""Pattern of a dotted key that is nested too deep; the time of the parser grows with the square of its length."""


def read_toml(path: str | Path) -> dict[str, Any]:
    """Tables of a TOML file.

    Raises
    ------
    CaseError
        The file does not exist, or it is not valid TOML; the message names the line.
    """
    return parse_toml(read_text(path), str(path))


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """Tables of a TOML text; `source` is its name in messages.

    Raises
    ------
    CaseError
        The text is not valid TOML; the message names the line.
    """
    if _LONG_KEY.search(text):
        raise CaseError(_TOO_DEEP, source)
    try:
        data = tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise CaseError(_TOO_DEEP, source) from None
    except ValueError as error:  # a number with thousands of digits also raises this
        raise CaseError(_syntax_fault(str(error), text), source) from None
    if is_too_deep(data):
        raise CaseError(_TOO_DEEP, source)
    return data


def is_too_deep(data: object) -> bool:
    """Whether lists and sections are nested deeper than `DEEPEST` levels."""
    return _depth_exceeds(data, DEEPEST)


def _depth_exceeds(data: object, most: int) -> bool:
    """Whether lists and sections are nested deeper than `most` levels."""
    level: list[object] = [data]
    for _ in range(most):
        level = [item for each in level for item in _below(each)]
        if not level:
            return False
    return True


def _below(item: object) -> Iterable[object]:
    inner = item.values() if isinstance(item, dict) else item if isinstance(item, list) else ()
    return [each for each in inner if isinstance(each, dict | list)]


def read_text(path: str | Path, most: int = _MOST_TEXT) -> str:
    """Text of a file of at most `most` bytes.

    Raises
    ------
    CaseError
        The file cannot be read, or it is not UTF-8 text.
    """
    try:
        return read_input_file(path, most).decode("utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            raise CaseError(f"is not UTF-8 text (byte {error.start}); save it as UTF-8", str(path)) from None
        raise CaseError(f"cannot read the file: {read_failure(error)}", str(path)) from None


def _syntax_fault(message: str, text: str) -> Fault:
    """Fault of a TOML syntax error, with line number, reason and the line itself."""
    match = re.search(r"^(.*?) \(at line (\d+), column (\d+)\)$", message)
    if match is None:
        return Fault("", f"is not valid TOML: {message[:1].lower()}{message[1:]}")
    what, number = match[1], int(match[2])
    line = text.splitlines()[number - 1].strip() if number <= len(text.splitlines()) else ""
    unquoted = "=" in line and (what == "Invalid value" or what.startswith("Expected newline"))
    hint = "; put text and numbers with a unit in quotes" if unquoted else ""
    shown = f" in `{line[:60]}`" if line else ""
    return Fault(f"line {number}", f"{what[:1].lower()}{what[1:]}{shown}{hint}")
