"""The report of `fsm check`, which needs no compiled kernels."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from fsm.case.models.case import Case
from fsm.case.models.scene import Body, ForceElement, Scene
from fsm.check import report
from fsm.check.contact import SURFACE_TIP
from fsm.check.report import describe
from fsm.errors import CaseError
from fsm.interactions.surfaces.surface import TIP
from fsm.model.compile.compile_case import compile_case
from fsm.model.contact.surfaces.surface_contacts import SurfaceContacts
from fsm.model.plan.planned import save_times
from tests.unit.test_compile import strip_case

CONTACT = {"stiffness": 1e6, "damping": 3.0}
STEP = {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": 1e-3, "v_dynamic": 1e-2}
SPLINE = {"law": "spline", "angle": [0.0, 1.0, 2.0], "moment": [0.0, 5e-3, 8e-3], "interpolation": "pchip"}
CASE = Path(__file__).parents[2] / "folding_cases" / "strip_trial" / "case.toml"


def text_of(**sections: Any) -> str:
    return "\n".join(describe(strip_case(title="a strip", **sections)))


def said(text: str, *wanted: str) -> None:
    for words in wanted:
        assert words in text, f"{words!r} is not in\n{text}"


def not_said(text: str, *unwanted: str) -> None:
    for words in unwanted:
        assert words not in text, f"{words!r} is in\n{text}"


def test_check_needs_no_compiler() -> None:
    """The command in a separate process does not import numba, h5py or matplotlib."""
    program = (
        "import sys\n"
        "from fsm.cli.command_line import cli\n"
        f"cli(['check', {str(CASE)!r}], standalone_mode=False)\n"
        "loaded = {'numba', 'llvmlite', 'h5py', 'matplotlib', 'pymunk'} & set(sys.modules)\n"
        "sys.exit(f'loaded: {loaded}' if loaded else 0)\n"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    said(result.stdout, "trial strip", "planar")


def test_a_drive_that_the_end_of_the_run_stops() -> None:
    """An end time of travel over speed leaves out the run-up; `check` and the run say so."""
    stopped = "stops at 39.6 of 40 mm: solve.end_time = 20 s is less than the duration of the drive with its run-up, 20.2 s"
    said(text_of(solve={"end_time": "20 s"}), stopped)
    warnings: list[str] = []
    compile_case(strip_case(solve={"end_time": "20 s"}), warnings=warnings)
    assert len(warnings) == 1 and stopped in warnings[0]
    not_said(text_of(solve={"end_time": "20.2 s"}), "stops at")
    not_said(text_of(), "stops at")


def test_a_load_on_a_held_panel_has_no_effect() -> None:
    load = {"body": "panel 6", "force": [1.0, 0.0, 0.0]}
    said(text_of(load=[load]), "load 'load on panel 6' has no effect: body 'panel 6' is held")
    steps = [{"name": name, "kind": "static", "duration": "1 s"} for name in ("one", "two")]
    said(text_of(drive=[], load=[load], step=steps), "load 'load on panel 6' has no effect")
    free = [steps[0], steps[1] | {"release": ["panel 6"]}]
    not_said(text_of(drive=[], load=[load], step=free), "has no effect")


def test_a_plain_strip() -> None:
    text = text_of()
    said(
        text,
        "a strip",
        "planar: all bodies move in the plane y = 0",
        "16 free, 2 held, 1 driven",
        "48 degrees of freedom, 3 for each free body",
        "12 joints between the segments of panels",
        "2 half joints between driven lines",
        "5 creases, linear",
        "half cell     on",
        "contact: no [contact]",
        "tabulated creases: none in this case",
        "degrees of freedom of 2 held bodies",
        "gravity: not given",
        "motion out of the plane",
        "guide = false includes it",
        "c = 1 ms x k for every spring (Kelvin-Voigt)",
        "crease 3 moves along (0, 0, 1) at 2 mm/s: run-up 0.4 mm, travel 40 mm, duration 20.2 s",
        "guided",
        "static, selected by auto: the drive is slow: kinetic over elastic energy is 2e-06, below 1e-05",
        "201 records, at equal intervals of travel",
        "segments of 20 mm: error O(l^2)",
        "inertia is neglected, except in a snap-through",
    )
    not_said(text, "halve the speed", "pairs:", "friction creeps", "l alpha/8", "edges", "friction: no", "decreases to zero")


def test_the_numbers_of_a_strip_are_said_with_their_units() -> None:
    text = text_of(material={"plate": True, "poisson": 0.3}, strip={"thickness": "0.3 mm"})
    said(text, "480 mm x 40 mm x 0.3 mm, 4.608 g; 6 panels of 80 mm at 80 deg from the horizontal")
    said(text, "E 3 GPa, Poisson's ratio 0.3, density 800 kg/m^3", "EI 296.7 N mm^2 (E w t^3/12/(1 - nu^2))")
    said(text, "crease 9 N mm/rad, 2.43 EI per panel length; no moment at 160 deg from flat (as folded)")
    rested = text_of(crease=SPLINE | {"scale": 2.0, "rest_angle": "150 deg"})
    said(rested, "crease 8 N mm/rad on average, 0 to 0.016 N m (scale 2)", "at 150 deg from flat (folded to 160 deg)")


@pytest.mark.parametrize(("speed", "may"), [("0.5 mm/s", False), ("2 mm/s", True), ("20 mm/s", False)])
def test_a_drive_at_a_speed_at_which_friction_falls_is_named(speed: str, may: bool) -> None:
    friction = {"mu_static": 0.3, "mu_dynamic": 0.2, "v_static": "1 mm/s", "v_dynamic": "10 mm/s"}
    drive = [{"crease": 3, "direction": [0, 0, 1], "speed": speed, "travel": "40 mm"}]
    text = text_of(contact={"stiffness": "1e8 N/m^1.5"}, friction=friction, drive=drive)
    (said if may else not_said)(text, "contacts may alternately stick and slip, and a run may take long")


def test_the_tension_that_segments_resolve_is_said() -> None:
    said(text_of(), "up to a tension of EI/l^2 = ")


def test_the_numbers_of_a_scene_are_said_with_their_units() -> None:
    arm = Body(name="arm", mass=0.1, inertia=(1e-3, 1e-3, 1e-3), velocity=(0.5, 0.0, 0.0))
    law = {"law": "linear", "stiffness": 0.05, "rest_angle": "60 deg"}
    hinge = ForceElement(name="hinge", inner="ground", outer="arm", translation=(1e5, 1e5, 1e5), crease=law)
    case = Case(scene=Scene(bodies=(arm,), elements=(hinge,)), solve={"end_time": 1.0})
    text = "\n".join(describe(case))
    said(text, "arm: 100 g, (0.001, 0.001, 0.001) kg m^2 at (0, 0, 0) mm, velocity (500, 0, 0) mm/s")
    said(text, "hinge: (100000, 100000, 100000) N/m, crease 0.05 N m/rad; twist 0 deg at the start, no moment at 60 deg")


def test_names_that_there_are_are_listed() -> None:
    arm = Body(name="arm", mass=0.1, inertia=(1e-3, 1e-3, 1e-3))
    case = Case(scene=Scene(bodies=(arm,)), load=[{"body": "tip"}], solve={"end_time": 1.0})
    with pytest.raises(CaseError, match="no body is called 'tip'; there are 'ground', 'arm'"):
        describe(case)


def test_a_fast_strip() -> None:
    text = text_of(pull={"speed": "20 mm/s"})
    said(text, "generalized-alpha, selected by auto: the drive is fast", "halve the speed")
    not_said(text, "inertia is neglected")


@pytest.mark.parametrize("method", ["static", "generalized-alpha", "Radau-blocks", "Radau", "BDF", "LSODA"])
def test_a_method_that_is_asked_for(method: str) -> None:
    text = text_of(solve={"method": method})
    said(text, f"{method}, set by solve.method", "inertia is neglected" if method == "static" else "halve the speed")
    not_said(text, "selected by auto", "halve the speed" if method == "static" else "inertia is neglected")


def test_pairs_that_are_listed() -> None:
    said(text_of(contact=CONTACT | {"pairs": [[3, 4]]}), "other panels pass through each other")
    not_said(text_of(contact=CONTACT), "pass through each other")


def test_contact_and_friction() -> None:
    text = text_of(contact=CONTACT, friction=STEP)
    said(
        text,
        "14 pairs: panel 1 - panel 2, panel 1 - panel 3",
        "K = 1e+06 N/m^1.5 for a whole face, damping C = 3 N s/m",
        "faces touch at half the sum of their thicknesses",
        "two STEP functions: mu 0.3 at 1 mm/s, 0.2 above 10 mm/s",
        "l alpha/8: 0.4363 mm at a joint bent by alpha = 10 deg",
        "decreases to zero",
        "a rounded tip of 2.5 % of its length; ends of other panels touch the whole tip, their other points half",

        "at most v = v_static tan(a)/mu_static, 1 mm/s",
    )
    not_said(text, "contact: no", "friction: no", "edges")


def test_contact_in_space_without_thickness_or_friction() -> None:
    text = text_of(contact=CONTACT | {"thickness_in_gap": False, "damping": 0.0}, solve={"spatial": True})
    said(
        text,
        "spatial: set by solve.spatial, although all bodies are in the plane",
        "96 degrees of freedom, 6 for each free body",
        "middle surfaces touch, because the gap does not include the thickness",
        "no damping",
        "friction: no [friction]; faces slide without friction",
        "side edges have no contact",
    )
    not_said(text, "decreases to zero", "motion out of the plane", "friction creeps")


@pytest.mark.parametrize(("stiffness", "soft"), [(1e12, False), (1e9, True)])
def test_contact_that_is_soft_for_the_strip(stiffness: float, soft: bool) -> None:
    """A strip of twice the thickness presses eight times as much."""
    text = text_of(contact={"stiffness": stiffness}, strip={"thickness": 6e-4})
    line = "contact.stiffness = 1e+09 N/m^1.5 is low for this strip: the penetration is about 0.1221 mm, which lowers"
    assert (line in text) == soft


def test_no_pair_that_can_meet() -> None:
    text = text_of(contact=CONTACT | {"pairs": []})
    said(text, "has no pair with a moving side")
    not_said(text, "pairs:", "Hertz", "l alpha/8")


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("segments", [1, 3, 7])
@pytest.mark.parametrize("pairs", [None, [[3, 4]], [[1, 3], [2, 5]]])
def test_counts_are_the_compilers(spatial: bool, segments: int, pairs: list[list[int]] | None) -> None:
    contact = CONTACT | {"points_per_segment": 3} | ({"pairs": pairs} if pairs else {})
    case = strip_case(contact=contact, strip={"segments_per_panel": segments}, solve={"spatial": spatial})
    _, system = compile_case(case)
    geometry = system.contacts[0].geometry
    assert isinstance(geometry, SurfaceContacts)
    said(
        "\n".join(describe(case)),
        f"{len(geometry.probes.body)} contact points",
        f"{system.nu} degrees of freedom",
        f"{len(system.bodies.free)} free, {int(sum(b.held for b in report.build_scene(case).bodies))} held",
        f"{len(set(geometry.probes.pair))} pair",
    )


def test_half_cell_off() -> None:
    text = text_of(strip={"half_cell": False})
    said(text, "half cell     off", "error O(l) without half cells")


def test_tabulated_creases() -> None:
    text = text_of(crease=SPLINE)
    said(text, "5 creases, tabulated: monotone (PCHIP) curve through 3 points from 0 to 114.6 deg, linear outside")
    not_said(text, "tabulated creases: none", "creases, linear")


def test_unguided_is_spatial_and_says_why() -> None:
    text = text_of(pull={"guide": False})
    said(text, "spatial: a crease line without guide can move out of the plane", "not guided: the line")
    not_said(text, "guide = false includes it")


def test_undamped_and_loaded() -> None:
    load = {"body": "panel 3 segment 1", "force": [0.0, 0.0, 1.5], "follower": True, "time": {"kind": "ramp", "end": 1.0}}
    text = text_of(material={"damping": 0.0}, load=[load], gravity=[0.0, 0.0, -9.81])
    said(text, "none in the springs", "follower, force (0, 0, 1.5) N, moment (0, 0, 0) N m, ramp", "(0, 0, -9.81) m/s^2")
    not_said(text, "halve material.damping", "gravity: not given")


def test_a_scene_written_out() -> None:
    arm = Body(name="arm", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(1.0, 0.0, 0.0))
    hinge = ForceElement(name="hinge", inner="arm", outer="ground", translation=(1e3, 1e3, 1e3))
    idle = ForceElement(name="idle", inner="arm", outer="ground")
    case = Case(scene=Scene(bodies=(arm,), elements=(hinge, idle)), solve={"end_time": 3.0}, save={"interval": 0.5})
    text = "\n".join(describe(case))
    said(
        text,
        "1 free, 0 held, 0 driven",
        "1 joint, linear springs",
        "1 force element without stiffness",
        "in 0 of 1 force element",
        "off: no crease has crease_flexibility",
        "7 records, one every 0.5 s",
        "end time 3 s",
    )
    not_said(text, "segments of", "halve the speed", "guide")


def test_faults_all_at_once() -> None:
    bodies = (Body(name="arm", mass=0.0, inertia=(1.0, 1.0, 1.0)), Body(name="arm", mass=1.0, inertia=(0.0, 1.0, 1.0)))
    with pytest.raises(CaseError) as caught:
        describe(Case(scene=Scene(bodies=bodies), solve={"end_time": 1.0}))
    assert len(caught.value.faults) >= 3
    assert all(line.startswith("scene.bodies") for line in caught.value.lines())


def test_nothing_says_when_to_stop() -> None:
    body = Body(name="arm", mass=1.0, inertia=(1.0, 1.0, 1.0))
    with pytest.raises(CaseError, match=r"solve\.end_time: missing"):
        describe(Case(scene=Scene(bodies=(body,))))


@pytest.mark.parametrize("contact", [None, CONTACT, CONTACT | {"thickness_in_gap": False}])
@pytest.mark.parametrize("angle", ["80 deg", "89.9 deg"])
def test_refuses_what_a_run_refuses(contact: dict[str, Any] | None, angle: str) -> None:
    case = strip_case(strip={"fold_angle": angle}, **({"contact": contact} if contact else {}))
    outcomes = []
    for examine in (describe, compile_case):
        try:
            examine(case)
            outcomes.append([])
        except CaseError as error:
            outcomes.append(error.lines())
    assert outcomes[0] == outcomes[1]
    assert bool(outcomes[0]) == (angle == "89.9 deg" and contact is CONTACT)


@pytest.mark.parametrize(
    "sections",
    [
        {},
        {"save": {"every": "1 mm"}},
        {"save": {"every": "0.7 mm"}},
        {"save": {"every": "0.1 m"}},
        {"save": {"interval": 0.3}},
        {"save": {"interval": 2.0}, "solve": {"end_time": 6.5}},
        {"save": {"every": "1 mm"}, "solve": {"end_time": 6.5}},
        {"save": {"every": "1 mm"}, "solve": {"end_time": 60.0}},
        {"solve": {"end_time": 6.5}},
    ],
    ids=repr,
)
def test_records_are_announced_as_they_will_be_saved(sections: dict[str, Any]) -> None:
    case = strip_case(**sections)
    _, system = compile_case(case)
    end = case.solve.end_time or system.end_time()
    assert end is not None
    times = save_times(case.save, system.motions[0].program, end)
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(end)
    assert all(b > a for a, b in pairwise(times))
    if "every" in sections.get("save", {}) and end <= system.motions[0].end_time:
        travel = [system.motions[0].at(t)[0] for t in times[:-1]]
        assert travel == pytest.approx([k * case.save.every for k in range(len(travel))], abs=1e-12)
    said("\n".join(describe(case)), f"{len(times)} records")


def test_constant_said_twice_agrees() -> None:
    assert SURFACE_TIP == TIP
