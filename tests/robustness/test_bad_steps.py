"""Mistakes in steps of a case: one fault each, with the path of the key."""

from __future__ import annotations

from pathlib import Path

import pytest

from fsm.errors import CaseError
from tests.physics.test_steps import BLOCK, PULL, STRIP, run

LATCH = BLOCK.split("[[scene.elements]]")[1].replace("wall", "x")
MISTAKES = (
    (f'[[scene.elements]]{LATCH}steps = ["end"]\n{PULL}', "scene.elements.2.steps", "no step is called 'end'"),
    (f"[[scene.elements]]{LATCH}latch = true\n{PULL}", "scene.elements.2.latch", "needs `steps`"),
    ('[[step]]\nkind = "static"\nhold = ["blok"]', "step.0.hold.0", "did you mean 'block'"),
    ('[[step]]\nkind = "static"\nrelease = ["hand"]', "step.0.release.0", "no held body and no acting drive"),
    ('[[step]]\nkind = "dynamic"', "step.0.duration", "is missing"),
    ('[[step]]\nkind = "relax"\nduration = 1', "step.0.duration", "takes no time"),
    ('[[step]]\nkind = "static"\nsolve = { method = "Radau" }', "step.0.solve.method", "does not fit"),
    ('[[step]]\nkind = "statik"', "step.0.kind", "static"),
    ('[[step]]\nkind = "static"\n[solve]\nend_time = 1', "solve.end_time", "cannot be used with [[step]]"),
    ('[[step]]\nkind = "static"\nname = "a"\n[[step]]\nkind = "static"\nname = "a"', "step.1.name", "must differ"),
    ('[[step]]\nkind = "static"\n[[load]]\nbody = "block"\nstep = "2"', "load.0.step", "no step is called '2'"),
    ('[[load]]\nbody = "block"\nstep = "2"\n[solve]\nend_time = 1', "load.0.step", "there is no [[step]]"),
    (PULL.replace("speed", "sped"), "step.0.drive.0", ""),
    (PULL + '[[step]]\nkind = "static"\nhold = ["hand"]', "step.1.hold.0", "is driven"),
)


@pytest.mark.parametrize(("steps", "path", "message"), MISTAKES)
def test_mistakes_have_one_clear_line(tmp_path: Path, steps: str, path: str, message: str) -> None:
    with pytest.raises(CaseError) as error:
        run(tmp_path, BLOCK + steps)
    (fault,) = error.value.faults
    assert fault.path.startswith(path)
    assert message in fault.message


STRIP_MISTAKES = (
    ("crease = 9", "step.0.drive.0.crease", "must be a crease number from 1 to 3"),
    ("crease = 1", "step.0.drive.0.crease", "is an edge of panel 1, which is held"),
    ('edge = "top"', "step.0.drive.0.edge", "only a [lattice] and a [sheet] have edges"),
    ('body = "panel 9"', "step.0.drive.0.body", "no body is called 'panel 9'"),
    ("crease = 3\nspede = 1", "step.0.drive.0.spede", "did you mean"),
)


@pytest.mark.parametrize(("target", "path", "message"), STRIP_MISTAKES)
def test_mistakes_in_drives_of_steps_have_the_path_of_the_step(tmp_path: Path, target: str, path: str, message: str) -> None:
    text = STRIP.replace("[[drive]]", '[[step]]\nkind = "static"\n[[step.drive]]').replace("crease = 3", target)
    with pytest.raises(CaseError) as error:
        run(tmp_path, text)
    (fault,) = error.value.faults
    assert fault.path == path
    assert message in fault.message
