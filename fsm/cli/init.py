"""Command `fsm init`."""

from __future__ import annotations

from pathlib import Path

import click

from fsm.cli.options import debug_option
from fsm.errors import CannotWrite, CaseError

_TEMPLATES = Path(__file__).with_name("templates")
_STUDIES = Path(__file__).with_name("study_templates")
"""Files of commands that vary a case; each has the name of its command."""
_ALSO = {
    "membrane": "film", "scissor": "array", "miura": "sheet", "rigid": "sheet", "bars": "kresling", "bend-lines": "pattern",
    "fold": "pattern", "tape-spring": "boom", "stem": "boom", "lenticular": "boom",
    "slider-crank": "mechanism", "joints": "mechanism", "solar-wing": "wing", "solar-array": "wing",
}  # fmt: skip
"""Other names of kinds: of sections, of patterns, and of facets."""


def kinds() -> dict[str, str]:
    """Kinds of cases with their first comments."""
    return {path.stem: _first_line(path) for path in sorted(_TEMPLATES.glob("*.toml"))}


def studies() -> dict[str, str]:
    """Kinds of files that vary a case, with their first comments."""
    return {path.stem: _first_line(path) for path in sorted(_STUDIES.glob("*.toml"))}


def _first_line(path: Path) -> str:
    return path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ").rstrip(".")


class _WithKinds(click.Command):
    """Command whose help lists all kinds."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the kinds with their descriptions."""
        with formatter.section("Kinds"):
            formatter.write_dl([*kinds().items(), *studies().items()])


@click.command(cls=_WithKinds)
@click.argument("kind", metavar="KIND")
@click.argument("file", metavar="[FILE]", default="")
@debug_option
def init(kind: str, file: str) -> None:
    """Write a commented case of a kind that runs, into FILE (default: case.toml; study.toml for a study)."""
    known = kinds() | studies()
    name = _ALSO.get(kind, kind)
    if name not in known:
        from fsm.case.schema.units import did_you_mean

        text = f'unknown kind "{kind[:40]}"{did_you_mean(kind, known)}; the kinds are {", ".join(known)}'
        raise CaseError(text, "init")
    text = ((_STUDIES if name in studies() else _TEMPLATES) / f"{name}.toml").read_text(encoding="utf-8")
    file = file or f"{name if name in studies() else 'case'}.toml"
    path = Path(file)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as target:
            target.write(text)
    except FileExistsError:
        raise CannotWrite(f"{file}: exists and is not overwritten; give another name: fsm init {kind} FILE") from None
    if name in studies():
        click.echo(f"{file} written for case.toml; next: fsm {name} {file} --out out; fsm help {name} explains its keys")
        return
    click.echo(f"{file} written; next: fsm check {file}, fsm run {file} --out out; fsm help KEY explains a key")
