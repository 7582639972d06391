"""Pages of figures and tables that need no scripts: one HTML file that works offline."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from fsm.io.atomic_write import atomic_write
from fsm.io.provenance import fsm_version

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"


@dataclass(frozen=True)
class Block:
    """Part of a page.

    Attributes
    ----------
    title : heading
    notes : paragraphs
    tables : (heading cells, rows of cells) of each table
    figures : (PNG file, description) of each figure
    """

    title: str
    notes: Sequence[str] = ()
    tables: Sequence[tuple[Sequence[str], Sequence[Sequence[str]]]] = ()
    figures: Sequence[tuple[Path, str]] = field(default=())


def write_page(path: Path, title: str, blocks: Sequence[Block]) -> None:
    """Write a page with embedded figures."""
    style = (files("fsm.views.report") / "page" / "report.css").read_text(encoding="utf-8")
    body = "\n".join(_section(block) for block in blocks)
    text = f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{html.escape(title)}</title>
<style>
{style}
main {{ max-width: 70rem; }} img {{ max-width: 100%; height: auto; background: white; }} .wide {{ overflow-x: auto; }}
</style>
</head>
<body>
<header><h1>{html.escape(title)}</h1><span class="faint">fsm {html.escape(fsm_version())}</span></header>
<main>
{body}
</main>
</body>
</html>
"""
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def _section(block: Block) -> str:
    parts = [f"<h2>{html.escape(block.title)}</h2>", *(f"<p>{html.escape(note)}</p>" for note in block.notes)]
    for head, rows in block.tables:
        cells = "".join(f'<th scope="col">{html.escape(cell)}</th>' for cell in head)
        lines = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
        parts.append(f'<div class="wide"><table><thead><tr>{cells}</tr></thead><tbody>{lines}</tbody></table></div>')
    for file, text in block.figures:
        data = base64.b64encode(file.read_bytes()).decode("ascii")
        parts.append(f'<figure><img src="data:image/png;base64,{data}" alt="{html.escape(text, quote=True)}"></figure>')
    return f'<section class="card">{"".join(parts)}</section>'
