"""Conversion of a case to TOML text that gives the same case when it is read again."""

from __future__ import annotations

import json
import re
from typing import Any

from fsm.case.models.case import Case

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def case_text(case: Case) -> str:
    """Complete case with defaults as TOML text in SI; numbers have all their digits, and absent keys stay absent."""
    data = case.model_dump(mode="python", exclude_none=True)
    data["units"] = "SI"
    return tables_text(data)


def tables_text(tables: dict[str, Any]) -> str:
    """Nested dicts and lists as TOML text; numbers have all their digits."""
    return "\n".join(_table(tables, "")).lstrip("\n") + "\n"


def _table(table: dict[str, Any], path: str) -> list[str]:
    """Lines of a table: first its own keys, then its inner tables."""
    lines = [f"{_key(key)} = {_value(item)}" for key, item in table.items() if not _is_section(item)]
    for key, item in table.items():
        below = f"{path}.{_key(key)}" if path else _key(key)
        if isinstance(item, dict):
            lines += ["", f"[{below}]", *_table(item, below)]
        elif _is_section(item):
            lines += [line for entry in item for line in ("", f"[[{below}]]", *_table(entry, below))]
    return lines


def _is_section(item: Any) -> bool:
    return isinstance(item, dict) or (isinstance(item, list | tuple) and bool(item) and isinstance(item[0], dict))


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _value(item: Any) -> str:
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, int | float):
        return repr(item)
    if isinstance(item, list | tuple):
        return f"[{', '.join(_value(entry) for entry in item)}]"
    return _text(str(item))


def _text(text: str) -> str:
    # a JSON string is also a TOML string, except for the character DEL
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
