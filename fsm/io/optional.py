"""Optional packages of the installation."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from fsm.errors import CaseError


def optional_module(name: str, purpose: str, extra: str) -> Any:
    """Import an optional package.

    Parameters
    ----------
    name : module
    purpose : use of the package, for the message
    extra : extra of the installation that has it

    Raises
    ------
    CaseError
        The package is not installed; the message has the command.
    """
    try:
        return import_module(name)
    except ImportError:
        package = name.partition(".")[0].replace("_", "-")
        text = f"{purpose} needs the package {package}, which is not installed; run: pip install 'fsm[{extra}]'"
        raise CaseError(text) from None
