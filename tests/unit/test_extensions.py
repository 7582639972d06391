"""Extensions: loading, refusals, and the tangents of elements with added laws."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fsm
from fsm import registry
from fsm.case.loading.load_case import LoadedCase, load_case
from fsm.errors import CaseError
from fsm.model.compile.compile_case import compile_case
from fsm.run.run_case import run_case
from fsm.run.table import run_table
from tests.tangents import check_force, check_tangents

LAW = """
import numpy as np
from fsm.extend import ElementLaw, Section, add_element_law
from fsm.scene.units import Length, Stiffness  # the place of earlier versions

class Cubic(Section):
    stiffness: Stiffness
    size: Length = 0.1

def effort(z, rate, p):
    k = p["stiffness"] * np.array([1.0, 2.0, 3.0, 0.01, 0.02, 0.03])
    preload = np.array([0.0, 0.0, 5.0, 0.0, 0.3, 0.0])
    return preload + k * (z + z**3 / p["size"]**2) + 0.1 * k * rate, k * (1 + 3 * z**2 / p["size"]**2), 0.1 * k

def energy(z, p):
    k = p["stiffness"] * np.array([1.0, 2.0, 3.0, 0.01, 0.02, 0.03])
    return float(k @ (z**2 / 2 + z**4 / (4 * p["size"]**2)) + 5.0 * z[2] + 0.3 * z[4])

add_element_law("cubic", ElementLaw(effort, energy, rate_dependent=True), Cubic)
"""
CASE = """
extensions = ["law.py"]
[[scene.bodies]]
name = "one"
mass = 1.0
inertia = [0.02, 0.03, 0.04]
[[scene.bodies]]
name = "two"
mass = 2.0
inertia = [0.02, 0.03, 0.04]
position = [0.3, 0.0, 0.1]
[[scene.elements]]
name = "link"
inner = "one"
outer = "two"
point_inner = [0.2, 0.0, 0.0]
point_outer = [-0.1, 0.0, -0.1]
law = "cubic"
parameters = { stiffness = "2 N/mm" }
[solve]
end_time = "1 ms"
"""


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    kinds: list[dict[str, Any]] = [registry.CONTACT_LAWS, registry.FRICTION_LAWS, registry.ELEMENT_LAWS, registry.BUILDERS]
    before = [dict(kind) for kind in kinds]
    yield
    for kind, own in zip(kinds, before, strict=True):
        kind.clear()
        kind.update(own)
    for name in [name for name in sys.modules if name.startswith("fsm_extension_")]:
        del sys.modules[name]


def loaded(folder: Path, law: str = LAW, case: str = CASE, *overrides: str) -> LoadedCase:
    (folder / "law.py").write_text(law, encoding="utf-8")
    (folder / "case.toml").write_text(case, encoding="utf-8")
    return load_case(folder / "case.toml", overrides)


@pytest.mark.parametrize("spatial", [False, True])
def test_tangents_of_an_added_law(spatial: bool, tmp_path: Path) -> None:
    """Preloads without stiffness have a geometric stiffness, too; dampers add the change of their rates."""
    case = loaded(tmp_path, LAW, CASE, f"solve.spatial={str(spatial).lower()}").case
    _, system = compile_case(case)
    rng = np.random.default_rng(3)
    q, u = system.initial()
    q = system.retract(q, 0.05 * rng.normal(size=system.nu))
    u = rng.normal(size=system.nu)
    check_tangents(system, q, u, (1e-6, 1e-6), 2e-6)
    check_force(system, q, 1e-6)


def test_geometric_stiffness_of_a_constant_effort(tmp_path: Path) -> None:
    """A constant force along e3 has no derivative; in space its stiffness matrix follows from the rotation of its axes."""
    law = """
import numpy as np
from fsm.extend import ElementLaw, add_element_law

def effort(z, rate, p):
    return np.array([0.0, 0.0, 5.0, 0.0, 0.3, 0.0]), 0.0, 0.0

add_element_law("constant", ElementLaw(effort, lambda z, p: 5.0 * z[2] + 0.3 * z[4]))
"""
    case = CASE.replace('"cubic"', '"constant"').replace('parameters = { stiffness = "2 N/mm" }', "")
    _, system = compile_case(loaded(tmp_path, law, case, "solve.spatial=true").case)
    q, _ = system.initial()
    q = system.retract(q, 0.1 * np.random.default_rng(5).normal(size=system.nu))
    stiffness = system.tangent(0.0, q, None)[0].toarray()
    by_difference = np.array([
        (system.force(0.0, system.retract(q, 1e-6 * e), None) - system.force(0.0, system.retract(q, -1e-6 * e), None)) / 2e-6
        for e in np.eye(system.nu)
    ]).T  # fmt: skip
    assert np.abs(by_difference).max() > 1.0
    np.testing.assert_allclose(stiffness, -by_difference, atol=1e-6 * np.abs(by_difference).max())


def test_the_text_of_a_case_gives_the_same_case(tmp_path: Path) -> None:
    """The results file names the extension with path and digest, and the extension is refused once its file has changed."""
    first = loaded(tmp_path)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "case.toml").write_text(first.text, encoding="utf-8")
    again = load_case(elsewhere / "case.toml")
    assert again.case == first.case and again.text == first.text
    assert first.case.scene is not None and first.case.scene.elements[0].parameters == {"stiffness": 2000.0, "size": 0.1}
    (tmp_path / "law.py").write_text(LAW + "\n# changed", encoding="utf-8")
    with pytest.raises(CaseError, match=r"extensions\.0: .*law\.py has changed since the case was written"):
        load_case(elsewhere / "case.toml")


def test_a_result_executes_nothing_unless_it_is_allowed(tmp_path: Path) -> None:
    """The file that a result names is executed only on request; the message names this file."""
    run_case(loaded(tmp_path, LAW, CASE, "solve.end_time=1e-6"), tmp_path / "out", progress=False, figures=False)
    mark = tmp_path / "executed"
    (tmp_path / "law.py").write_text(f"open({str(mark)!r}, 'w')", encoding="utf-8")
    with pytest.raises(CaseError, match=r"extensions: .*law\.py.*none was executed.*allow_extensions=True"):
        _ = fsm.open(tmp_path / "out").case
    assert fsm.open(tmp_path / "out").time[0] == 0.0 and not mark.exists()
    (tmp_path / "law.py").write_text(LAW, encoding="utf-8")
    again = fsm.open(tmp_path / "out", allow_extensions=True).case.model.scene
    assert again is not None and again.elements[0].law == "cubic"


@pytest.mark.parametrize(
    ("law", "case", "fault"),
    [
        (LAW, CASE.replace('["law.py"]', '["other.py"]'), r"extensions\.0: cannot read .*other\.py"),
        ("x = = 1", CASE, r"extensions\.0: .*law\.py, line 1: SyntaxError"),
        ("\n\nraise KeyError('a')", CASE, r"extensions\.0: .*law\.py, line 3: KeyError"),
        ("raise SystemExit(3)", CASE, r"extensions\.0: .*law\.py, line 1: SystemExit"),
        (LAW, CASE.replace('"cubic"', '"cubik"'), r'scene\.elements\.0\.law: must be "cubic"; it is "cubik"'),
        (LAW, CASE.replace("2 N/mm", "2 N"), r"scene\.elements\.0\.parameters: stiffness: \"2 N\" has the wrong unit"),
        (LAW, CASE.replace("stiffness =", "stifness ="), r"parameters: stiffness: missing.*stifness: unknown key"),
        (LAW, CASE.replace('parameters = { stiffness = "2 N/mm" }', ""), r"parameters: stiffness: missing"),
        (LAW, CASE.replace("[solve]", "[cable_car]\nx = 1\n[solve]"), r"cable_car: unknown key"),
        (
            "from fsm.extend import add_contact_law\nadd_contact_law('hertz', None)", CASE,
            r"line 2: ValueError: 'hertz' is already a name in fsm",
        ),
    ],
)  # fmt: skip
def test_faults_are_told_with_their_place(law: str, case: str, fault: str, tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=fault):
        loaded(tmp_path, law, case)


def test_parameters_need_an_extension(tmp_path: Path) -> None:
    case = CASE.replace('extensions = ["law.py"]', "").replace('law = "cubic"', "")
    with pytest.raises(CaseError, match=r"parameters: not used with law = None|parameters: not used"):
        loaded(tmp_path, LAW, case)
    with pytest.raises(CaseError, match=r"needs an extension that adds it"):
        loaded(tmp_path, LAW, CASE.replace('extensions = ["law.py"]', ""))


@pytest.mark.nightly
def test_workers_of_a_table_load_the_extensions(tmp_path: Path) -> None:
    loaded(tmp_path)
    rows = ["# base = case.toml", "case, scene.elements.0.parameters.stiffness", "soft, 1 N/mm", "stiff, 4 N/mm"]
    (tmp_path / "table.csv").write_text("\n".join(rows), encoding="utf-8")
    found = run_table(tmp_path / "table.csv", tmp_path / "out", (), 1, False, None, progress=False)
    assert [row.get("error") for row in found] == [None, None] or not any(row.get("error") for row in found)
