"""Runner of every part of every folder; each result is stored in checks.json as soon as it is complete."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
import subprocess
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation.gallery.folders import checks_of, place_on_page
from validation.gallery.record import Check, NotCompared, Part, Place

__all__ = ["collect", "run"]

REPOSITORY = Path(__file__).parents[2]
SOURCES = ("fsm/**/*.py", "validation/**/*.py", "folding_cases/**/*.toml", "folding_cases/**/*.csv")


def run(only: list[str], out: Path, full: bool = False, again: bool = False, say: Callable[[str], None] = print) -> int:
    """Run the selected parts, and write `out`/checks.json after each; 1 if a failed check has no valid reason."""
    sources = fingerprint()
    path = out / "checks.json"
    kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))["parts"] if path.is_file() else {}
    unknown = 0
    for folder in dict.fromkeys(name.split("/")[0] for name in only):
        module = checks_of(folder)
        for part, function in module.PARTS.items():
            key = f"{folder}/{part}"
            if folder not in only and key not in only:
                continue
            done = kept.get(key, {})
            if not again and done.get("sources") == sources and (done["full"] or not full):
                say(f"{key}: done before")
            else:
                say(f"{key}: {first_line(function)}")
                kept[key] = collect(function, Place(out / folder / part, full)) | {
                    "folder": module.TITLE,
                    "what": first_line(function),
                    "sources": sources,
                    "full": full,
                }
                for check in kept[key]["checks"]:  # figures are stored beside checks.json
                    check["figure"] = check["figure"] and os.path.relpath(check["figure"], out)
                write(path, kept)
            checks = kept[key]["checks"]
            red = [check for check in checks if not check["passed"]]
            unknown += sum(not check["explained"] for check in red)
            say(f"    {len(checks) - len(red)} green, {len(red)} red, {kept[key]['seconds']:.1f} s")
            for check in red:
                say(f"    RED {check['name']}: {check['told']}")
    return int(unknown > 0)


def collect(function: Part, place: Place) -> dict[str, Any]:
    """Checks of a part as plain data, with the seconds since the previous check; an exception counts as a failed check."""
    checks: list[dict[str, Any]] = []
    left_out: list[dict[str, str]] = []
    begun = last = time.perf_counter()
    place.out.mkdir(parents=True, exist_ok=True)
    for item in _guarded(function, place):
        now = time.perf_counter()
        if isinstance(item, NotCompared):
            left_out.append(asdict(item))
            continue
        checks.append(plain(item) | {"seconds": now - last})
        last = now
    # figures may be drawn after all checks, so their existence is tested at the end
    for check in checks:
        figure = Path(check["figure"])
        if not (figure.is_file() and figure.stat().st_size):
            told = f"no picture {figure.name}: " + check["told"]
            check |= {"passed": False, "explained": False, "told": told, "figure": ""}
    return {"checks": checks, "not_compared": left_out, "seconds": time.perf_counter() - begun}


def _guarded(function: Part, place: Place) -> Iterator[Check | NotCompared]:
    try:
        yield from function(place)
    except Exception as error:  # whatever the error is, the other parts continue
        traceback.print_exc()
        told = f"{type(error).__name__}: {error}".splitlines()[0]
        yield Check("the whole part", "", "", told, "", float("inf"), 0.0, "bound", place.out / "none.png")


def plain(check: Check) -> dict[str, Any]:
    """Value in types of JSON."""
    data = asdict(check) | {
        "passed": check.passed,
        "explained": check.explained,
        "told": check.told,
        "figure": str(check.figure),
        "number": None if check.number is None or not math.isfinite(check.number) else check.number,
    }
    return data | {"error": check.error if check.error < 1e300 else 1e300}


def write(path: Path, parts: dict[str, Any]) -> None:
    """Write the file atomically: an interrupted run leaves the last complete file. Results in the order of the page."""
    parts = dict(sorted(parts.items(), key=lambda item: place_on_page(item[0].split("/")[0])))
    whole = {
        "commit": commit(),
        "date": time.strftime("%d %B %Y %H:%M"),
        "machine": machine(),
        "parts": parts,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(whole, indent=1), encoding="utf-8")
    part.replace(path)


def first_line(function: Part) -> str:
    return (function.__doc__ or function.__name__).splitlines()[0]


def fingerprint() -> str:
    """Digest of everything that determines the numbers of a check."""
    digest = hashlib.sha256()
    for pattern in SOURCES:
        for path in sorted(REPOSITORY.glob(pattern)):
            digest.update(path.relative_to(REPOSITORY).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def commit() -> str:
    """Short name of the commit, with a plus if the tree has changes; empty outside a repository."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", "-C", str(REPOSITORY), *words], capture_output=True, text=True, check=True)
        return done.stdout.strip()

    try:
        return git("rev-parse", "--short", "HEAD") + ("+" if git("status", "--porcelain", "-uno") else "")
    except (OSError, subprocess.CalledProcessError):
        return ""


def machine() -> str:
    return f"{os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"
