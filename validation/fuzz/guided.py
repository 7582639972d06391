"""Guided damage: atheris changes files so that they reach branches that no earlier file reached.

`run_guided` starts a process for every reader, because libFuzzer ends the process in which it runs; this module runs in that
process.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from fsm.kernels import jit

if __name__ != "__main__":
    from validation.fuzz.seeds import Seeds, seeds

__all__ = ["GUIDED", "run_guided"]

MEMORY, PATIENCE = 4096, 30
"""MB that the process may take, compiler included, and seconds for a file."""


@dataclass(frozen=True)
class Guided:
    """Input of a reader.

    Attributes
    ----------
    name : name of the file that is changed
    whole : function from seeds to the initial files
    beside : function from seeds to the files in the same folder, by name
    read : name of the file that the reader opens, if it is a different file
    """

    name: str
    whole: Callable[[Seeds], list[bytes]]
    beside: Callable[[Seeds], dict[str, bytes]] = lambda seeds: {}
    read: str = ""


def _csv(kind: str) -> Guided:
    return Guided(f"{kind}.csv", lambda seeds: [text.encode() for text in seeds.csv[kind]])


def _hdf5(name: str) -> Guided:
    return Guided(f"{name}.h5", lambda seeds: seeds.hdf5[name])


GUIDED: dict[str, Guided] = {
    "case": Guided("case.toml", lambda seeds: [text.encode() for text in seeds.cases], lambda seeds: seeds.beside),
    "table": Guided(
        "table.csv",
        lambda seeds: [text.encode() for text in seeds.tables[0][1]],
        lambda seeds: {**seeds.beside, "case.toml": seeds.tables[0][0].encode()},
    ),
    "crease": _csv("crease"),
    "relaxation": _csv("relaxation"),
    "bending": _csv("bending"),
    "study": Guided("study.toml", lambda seeds: [seeds.study.encode()]),
    "family": Guided(
        "crease.h5", lambda seeds: seeds.hdf5["crease"], lambda seeds: {"case.toml": seeds.with_family.encode()}, "case.toml"
    ),
    "result": _hdf5("result"),
    "checkpoint": _hdf5("checkpoint"),
}


def run_guided(target: str, seconds: int, seed: int, keep: Path) -> tuple[int, int, str]:
    """Give files to a reader for a time; returns their number, the number of branches that they reached, and the fault, if
    any.

    The first file that shows a fault is stored in `keep`, and the run ends.
    """
    given = GUIDED[target]
    work = Path(tempfile.mkdtemp(prefix="fsm-fuzz-"))
    try:
        for name, files in (("corpus", dict(enumerate(given.whole(seeds())))), ("beside", given.beside(seeds()))):
            (work / name).mkdir()
            for key, data in files.items():
                (work / name / str(key)).write_bytes(data)
        keep.mkdir(parents=True, exist_ok=True)
        longest = 2 * max(map(len, given.whole(seeds())))
        options = [f"-max_total_time={seconds}", f"-seed={seed}", f"-timeout={PATIENCE}", f"-rss_limit_mb={MEMORY}"]
        options += [f"-max_len={longest}", f"-artifact_prefix={keep}/{target}-", "-print_final_stats=1"]
        command = [sys.executable, "-m", __name__, target, str(work), given.name, given.read or given.name]
        done = subprocess.run([*command, *options, str(work / "corpus")], capture_output=True, text=True, errors="replace")
    finally:
        shutil.rmtree(work)
    said = done.stderr + done.stdout  # output of libFuzzer, and the error message of Python
    runs, reached = (re.findall(words, said) for words in (r"number_of_executed_units:\s*(\d+)", r"cov: (\d+)"))
    wrong = "" if done.returncode == 0 else said[-3000:]
    return int(runs[-1]) if runs else 0, int(reached[-1]) if reached else 0, wrong


def _main() -> None:
    """Run libFuzzer; arguments: target, working folder, name of the file, name of the input, options of libFuzzer."""
    import atheris

    with atheris.instrument_imports(include=["fsm", "tomllib", "csv", "json"], exclude=_compiled()):
        from fsm.errors import FsmError
        from validation.fuzz.targets import TARGETS

    target, work, name, opened = sys.argv[1:5]
    folder = Path(work) / "files"

    def give(data: bytes) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(Path(work) / "beside", folder)
        (folder / name).write_bytes(data)
        # these are messages: the command line prints both in one line and ends with code 2
        with suppress(FsmError, OSError):
            TARGETS[target].read(folder / opened)

    atheris.Setup([sys.argv[0], *sys.argv[5:]], give)
    atheris.Fuzz()


def _compiled() -> list[str]:
    """Modules that define kernels; compiled functions must not be instrumented."""
    package = Path(jit.__file__).parents[1]
    files = [file for file in package.rglob("*.py") if "@kernel" in file.read_text(encoding="utf-8")]
    return [".".join((package.name, *file.relative_to(package).with_suffix("").parts)) for file in files]


if __name__ == "__main__":
    _main()
