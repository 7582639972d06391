"""The gallery as pages for Sphinx: one page of all checks, made from checks.json."""

from __future__ import annotations

import html
import json
import re
import shutil
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from validation.gallery.folders import NOT_IN_GALLERY
from validation.gallery.record import number

__all__ = ["write_gallery"]

PICTURES = "extra/gallery_pictures"
"""Below the folder of the page; `extra` is what Sphinx copies beside its pages (html_extra_path)."""

EMPTY = """# Gallery

No checks have been run for this copy of the pages: `make validate` runs them and builds the site with them.
"""


def write_gallery(checks: Path, out: Path) -> None:
    """Write gallery.md and its figures into `out`.

    Parameters
    ----------
    checks : checks.json of a run; without it the page states how to create it
    out : folder, which is emptied first
    """
    shutil.rmtree(out, ignore_errors=True)
    (out / PICTURES).mkdir(parents=True)
    page = out / "gallery.md"
    if not checks.is_file():
        page.write_text(EMPTY, encoding="utf-8")
        return
    whole = json.loads(checks.read_text(encoding="utf-8"))
    parts: dict[str, dict[str, Any]] = whole["parts"]
    for part in parts.values():
        for check in part["checks"]:
            check["figure"] = check["figure"] and str(checks.parent / check["figure"])
    page.write_text("\n".join(_page(whole, parts, out)), encoding="utf-8")


def _page(whole: dict[str, Any], parts: dict[str, dict[str, Any]], out: Path) -> Iterable[str]:
    rows = [(key, check) for key, part in parts.items() for check in part["checks"]]
    red = [(key, check) for key, check in rows if not check["passed"]]
    seconds = sum(part["seconds"] for part in parts.values())
    yield "# Gallery\n"
    yield (
        "Every number that the program is held against: closed forms, converged solutions of other "
        "methods, published numbers, measured "
        "data, and what three papers say in words. Each has its source, our value, the error and what is "
        "allowed, and a picture of our curve "
        "with the reference. What is red stays red, with its reason where one is known for this value. "
        "`make validate` makes this page anew.\n"
    )
    yield (
        f'<p class="counts"><span class="green">{len(rows) - len(red)} green</span> <span class="red">{len(red)} red</span> '
        f"{len(parts)} parts, {seconds / 60:.1f} minutes · {html.escape(whole['date'])} · commit "
        f"{html.escape(whole['commit'] or 'unknown')} · "
        f"{html.escape(whole['machine'])}</p>\n"
    )
    if red:
        yield "## What is red\n"
        yield _head("check", "reason")
        for key, check in red:
            link = f'<a href="#{anchor(key)}">{html.escape(key)}</a>: {html.escape(check["name"])}'
            yield f"<tr><td>{link}</td>{_cell(check['told'])}</tr>"
        yield "</tbody></table>\n"
    yield from _overview(parts)
    folder = ""
    for key, part in parts.items():
        if part["folder"] != folder:
            folder = part["folder"]
            yield f"\n## {folder}\n"
        yield from _part(key, part, out)
    yield from _left_out(parts)


def _overview(parts: dict[str, dict[str, Any]]) -> Iterable[str]:
    yield "## Overview\n"
    yield _head("part", "what", "checks", "red", "time (s)")
    for key, part in parts.items():
        red = sum(not check["passed"] for check in part["checks"])
        yield (
            f'<tr class="{"fail" if red else "pass"}"><td><a href="#{anchor(key)}">{html.escape(key)}</a></td>'
            f"<td>{html.escape(part['what'])}</td>"
            f"<td>{len(part['checks'])}</td><td>{red or ''}</td><td>{part['seconds']:.1f}</td></tr>"
        )
    yield "</tbody></table>\n"


def _part(key: str, part: dict[str, Any], out: Path) -> Iterable[str]:
    checks = part["checks"]
    red = sum(not check["passed"] for check in checks)
    yield f'\n<section class="part {"fail" if red else "pass"}" id="{anchor(key)}">\n'
    verdict = f'<span class="red">{red} red</span>' if red else '<span class="green">green</span>'
    yield f"<h3>{html.escape(part['what'])}</h3>"
    yield f'<p class="small">{html.escape(key)} · {len(checks)} checks · {part["seconds"]:.1f} s · {verdict}</p>\n'
    pictures = dict.fromkeys(check["figure"] for check in checks if check["figure"])
    yield '<div class="pictures">'
    for picture in pictures:
        name = f"{anchor(key)}-{Path(picture).name}"
        if Path(picture).is_file():
            shutil.copy(picture, out / PICTURES / name)
            told, at = html.escape(f"{key}: {Path(picture).stem}"), f"../gallery_pictures/{name}"
            yield f'<a href="{at}"><img loading="lazy" src="{at}" alt="{told}"></a>'
    yield "</div>"
    if all(check["kind"] == "said" for check in checks):
        yield _head("statement", "the source says", "here", "source", "", kind="words")
        for check in checks:
            yield "".join(
                (
                    _row(check),
                    _cell(check["name"]),
                    _cell(check["reference"]),
                    _value(check),
                    _cell(check["source"], "source"),
                    _verdict(check),
                )
            )
    else:
        yield _head("case", "reference", "ours", "error", "allowed", "source", "s", "", kind="numbers")
        for check in checks:
            name = html.escape(check["name"]) + (
                f'<br><span class="small">{html.escape(check["what"])}</span>' if check["what"] else ""
            )
            unit = f" {check['unit']}" if check["unit"] else ""
            reference = check["reference"] if isinstance(check["reference"], str) else number(check["reference"]) + unit
            is_number = check["kind"] in ("relative", "absolute")
            error = f"{check['error']:.1e}" + (unit if check["kind"] == "absolute" else "") if is_number else ""
            allowed = f"{check['tolerance']:.1e}" + (unit if check["kind"] == "absolute" else "") if is_number else ""
            yield "".join(
                (
                    _row(check),
                    f"<td>{name}</td>",
                    _cell(reference),
                    _value(check),
                    _cell(error, "number"),
                    _cell(allowed, "number"),
                    _cell(check["source"], "source"),
                    _cell(f"{check['seconds']:.1f}", "number"),
                    _verdict(check),
                )
            )
    yield "</tbody></table>\n</section>\n"


def _head(*names: str, kind: str = "") -> str:
    cells = "".join(f"<th>{name}</th>" for name in names)
    return f'<table class="checks {kind}"><thead><tr>{cells}</tr></thead><tbody>'


def _row(check: dict[str, Any]) -> str:
    return f'<tr class="{"pass" if check["passed"] else "fail"}">'


def _cell(text: str, kind: str = "") -> str:
    return f'<td class="{kind}">{html.escape(text)}</td>' if kind else f"<td>{html.escape(text)}</td>"


def _value(check: dict[str, Any]) -> str:
    unit = f" {check['unit']}" if check["unit"] else ""
    more = f'<br><span class="small">{html.escape(check["detail"])}</span>' if check["detail"] else ""
    return f"<td>{html.escape(number(check['value']) + unit)}{more}</td>"


def _verdict(check: dict[str, Any]) -> str:
    if check["passed"]:
        return '<td class="green">✓</td></tr>'
    return (
        f'<td class="red">✗</td></tr>\n<tr class="fail"><td colspan="9" class="red">{html.escape(check["told"])}</td></tr>'
    )


def _left_out(parts: dict[str, dict[str, Any]]) -> Iterable[str]:
    yield "\n## What is not compared, and why\n"
    yield _head("number or statement", "source", "why not")
    for part in parts.values():
        for row in part["not_compared"]:
            yield f"<tr>{_cell(row['name'])}{_cell(row['source'], 'source')}{_cell(row['reason'])}</tr>"
    for folder, reason in NOT_IN_GALLERY.items():
        yield f"<tr>{_cell(f'validation/{folder}')}<td></td>{_cell(reason)}</tr>"
    yield "</tbody></table>\n"


def anchor(key: str) -> str:
    """Text for a link: letters, digits and dashes only."""
    return re.sub(r"[^a-z0-9]+", "-", key.lower()).strip("-")


if __name__ == "__main__":
    write_gallery(Path(sys.argv[1]), Path(sys.argv[2]))
