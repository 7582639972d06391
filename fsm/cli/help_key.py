"""Commands `fsm help` and `fsm schema`: description of the keys of a case file, for users and for editors."""

from __future__ import annotations

from pathlib import Path

import click

from fsm.cli.options import debug_option

_extension_option = click.option(
    "--extension", "extensions", multiple=True, metavar="FILE.py", help="Include the keys of an extension."
)


def _load(extensions: tuple[str, ...]) -> None:
    """Execute extensions; faults end the command."""
    from fsm.errors import CaseError
    from fsm.registry import load_extensions

    faults = load_extensions(extensions, Path())[1]
    if faults:
        raise CaseError(faults, "--extension")


@click.command(name="help")
@click.argument("key", metavar="[KEY]", default="")
@_extension_option
@debug_option
def help_key(key: str, extensions: tuple[str, ...]) -> None:
    """Explain a key or a section of case files: strip.fold_angle, contact; without KEY, list the sections.

    The files of --extension are executed.
    """
    from fsm.case.loading.key_help import help_lines

    _load(extensions)
    for line in help_lines(key):
        click.echo(line)


@click.command()
@click.option("--out", metavar="FILE", help="File to write; default: standard output.")
@_extension_option
@debug_option
def schema(out: str | None, extensions: tuple[str, ...]) -> None:
    """Print the JSON Schema of case files, with which editors complete and check keys.

    The files of --extension are executed.
    """
    import json

    from fsm.case.loading.json_schema import case_schema
    from fsm.registry import BUILDERS

    _load(extensions)
    added = {name: builder.section for name, builder in BUILDERS.items()} if extensions else {}
    text = json.dumps(case_schema(added), indent=2, ensure_ascii=False)
    if out is None:
        click.echo(text)
        return
    from fsm.io.atomic_write import atomic_write

    with atomic_write(out) as part:
        part.write_text(text + "\n", encoding="utf-8")
    line = f"#:schema {Path(out).as_posix()}"
    click.echo(f'{out} written; editors with Taplo use it in a case file whose first line is "{line}"')
