"""The cache of compiled kernels: it is kept between processes, never outdated, and never blocks a run.

Every test gives a toy package, with a copy of the compiler of `fsm/kernels`, to fresh Python processes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest

KERNELS_PACKAGE = Path(__file__).resolve().parents[2] / "fsm" / "kernels"
COPIED = (
    "jit.py", "dispatcher.py", "cache_folder.py", "compile_lock.py", "array_items.py", "records.py",
    "linked_code.py", "machine_code.py", "lowering.py",
)  # fmt: skip

CALLEE = """
    from toy.kernels.jit import kernel

    @kernel(inline=True)
    def scale(x):
        return FACTOR * x
"""
CALLER = """
    from typing import NamedTuple
    import numpy as np
    from toy.kernels.callee import scale
    from toy.kernels.jit import kernel

    class Params(NamedTuple):
        stiffness: np.ndarray

    @kernel
    def effort(x, params, power=1):
        total = 0.0
        for i in range(x.size):
            total += scale(x[i]) * params.stiffness[i] ** power
        return total
"""
POWERS = """
    from toy.kernels.jit import kernel

    @kernel
    def cube(x):
        return x * x * x

    @kernel
    def sums(x):
        return cube(x) + cube(4)
"""
PLAIN_CALLEE = """
    import numba

    @numba.njit(cache=True)
    def scale(x):
        return FACTOR * x
"""
PLAIN_CALLER = """
    import numba
    from toy.plain.callee import scale

    @numba.njit(cache=True)
    def effort(x):
        return scale(x)
"""
RUN = """
    import json
    import numba
    import numpy as np
    from numba.core import event

    def settings():
        return [numba.config.CACHE_DIR, numba.config.CACHE_LOCATOR_CLASSES]

    before = settings()
    from toy.kernels import cache_folder, jit
    compiled = []
    forget = jit.on_compile(compiled.append)
    from toy.laws.caller import Params, effort
    config_kept = settings() == before
    with event.install_listener("numba:compile", event.TimingListener()) as clock:
        value = effort(np.ones(3), Params(np.full(3, 2.0)))
    integers = lambda: effort(np.arange(3), Params(np.full(3, 2.0)))
    extra = {}
"""
REPORT = """
    folder = cache_folder.cache_folder()
    clock = clock.duration if clock.done else 0.0
    report = dict(value=value, compiled=compiled, clock=clock, config_kept=config_kept)
    report |= dict(misses=jit.cache_misses(), compile_time=jit.compile_time(), known=jit.kernel_names())
    report |= dict(folder=folder and str(folder))
    print(json.dumps(report | extra))
"""
KERNELS = ["toy.laws.caller.effort", "toy.kernels.callee.scale"]


@dataclass
class Toy:
    """A package of two kernels, the caller in one file and the callee in another."""

    root: Path
    stderr: str = ""

    def __post_init__(self) -> None:
        for package in ("__init__.py", "kernels/__init__.py", "laws/__init__.py", "plain/__init__.py"):
            self.write(package, "")
        for name in COPIED:
            text = (KERNELS_PACKAGE / name).read_text()
            self.write(f"kernels/{name}", text.replace("fsm.kernels", "toy.kernels"))
        self.write("laws/caller.py", CALLER)
        self.write("plain/caller.py", PLAIN_CALLER)
        self.set_factor(5)

    @property
    def cache(self) -> Path:
        return self.root / "cache"

    def write(self, name: str, text: str) -> None:
        path = self.root / "toy" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(dedent(text).lstrip())

    def set_factor(self, factor: int) -> None:
        self.write("kernels/callee.py", CALLEE.replace("FACTOR", f"{factor}.0"))
        self.write("plain/callee.py", PLAIN_CALLEE.replace("FACTOR", f"{factor}.0"))

    def run(self, extra: str = "", **environment: str) -> dict[str, Any]:
        """Run both kernels, then the lines `extra`, in a new process."""
        clean = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA_", "COV", "XDG_"))}
        # without .pyc files, because Python detects an edit only by the size and the time (in s) of the file
        ours = {
            "PYTHONPATH": str(self.root),
            "PYTHONDONTWRITEBYTECODE": "1",
            "NUMBA_CACHE_DIR": str(self.cache),
        }
        done = subprocess.run(
            [sys.executable, "-c", dedent(RUN) + dedent(extra) + dedent(REPORT)],
            env=clean | ours | environment,
            capture_output=True,
            text=True,
            check=False,
        )
        self.stderr = done.stderr
        assert done.returncode == 0, done.stderr
        report: dict[str, Any] = json.loads(done.stdout)
        return report

    def entries(self, pattern: str = "*.code-*") -> list[Path]:
        return sorted(self.cache.rglob(pattern))


@pytest.fixture
def toy(tmp_path: Path) -> Toy:
    return Toy(tmp_path)


def test_second_process_compiles_nothing(toy: Toy) -> None:
    cold = toy.run()
    assert cold["value"] == 30.0
    assert cold["misses"] == 2
    assert cold["compiled"] == KERNELS
    assert sorted(cold["known"]) == sorted(KERNELS)
    # the callee is compiled inside the caller, and its time counted once
    assert cold["compile_time"] == pytest.approx(cold["clock"], rel=0.05)

    warm = toy.run()
    assert warm["value"] == 30.0
    assert warm["misses"] == 0
    assert warm["compiled"] == []
    assert warm["compile_time"] == 0.0
    assert warm["folder"] == cold["folder"]
    assert Path(warm["folder"]).is_relative_to(toy.cache / "toy" / "kernels")


def test_the_first_use_makes_a_kernel_also_from_several_threads(toy: Toy) -> None:
    toy.write("laws/powers.py", POWERS)
    calls = """
        from concurrent.futures import ThreadPoolExecutor
        from toy.laws.powers import cube, sums
        extra["before"] = [type(each).__name__ for each in (cube, sums)]
        with ThreadPoolExecutor(4) as pool:
            extra["values"] = list(pool.map(cube, [1, 2, 3, 4, 5, 6]))
        extra["after"] = [type(each).__name__ for each in (cube, sums)]
        extra["names"] = [cube.__name__, sums.__name__]
    """
    found = toy.run(dedent(calls))
    assert found["before"] == ["ImportedKernel", "ImportedKernel"]
    assert found["values"] == [1, 8, 27, 64, 125, 216]
    assert found["after"] == ["KernelDispatcher", "ImportedKernel"]
    assert found["names"] == ["cube", "sums"]


@pytest.mark.nightly
def test_machine_code_only_for_what_python_calls(toy: Toy) -> None:
    toy.run()
    assert [path.name.split("-")[0] for path in toy.entries()] == ["caller.effort.code"]
    call = "from toy.kernels.callee import scale; extra['scaled'] = scale(2.0)"
    assert toy.run(call)["scaled"] == 10.0
    assert len(toy.entries("callee.scale.code-*")) == 1
    assert toy.run(call)["misses"] == 0


@pytest.mark.nightly
def test_a_kernel_is_compiled_once_for_python_and_other_kernels(toy: Toy) -> None:
    """Also if one of its calls has a constant as argument."""
    toy.write("laws/powers.py", POWERS)
    alone = toy.run()["misses"]
    calls = "from toy.laws.powers import cube, sums; extra['values'] = [cube(2), sums(3)]"
    both = toy.run(calls, NUMBA_CACHE_DIR=str(toy.root / "other"))
    assert both["values"] == [8, 27 + 64]
    assert both["misses"] == alone + 2


def test_edit_of_a_callee_is_seen(toy: Toy) -> None:
    plain = "from toy.plain.caller import effort as plain; extra['plain'] = plain(1.0)"
    first = toy.run(plain)
    toy.set_factor(7)
    second = toy.run(plain)
    toy.set_factor(5)
    third = toy.run()

    assert (first["value"], second["value"], third["value"]) == (30.0, 42.0, 30.0)
    assert second["misses"] == 2
    assert len([path for path in toy.entries("caller.effort.code-*") if path.is_relative_to(toy.cache / "toy")]) == 2
    assert third["misses"] == 0  # back to the first sources: their machine code is still in the cache
    # The behaviour of numba alone, which is the reason for this cache. If this test fails, numba has been improved.
    assert (first["plain"], second["plain"]) == (5.0, 5.0)


def test_code_of_linked_functions_is_kept_for_other_kernels(toy: Toy) -> None:
    other = """
        import numpy as np
        from toy.kernels.callee import scale
        from toy.kernels.jit import kernel

        @kernel
        def half(x):
            return 0.5 * scale(x)
    """
    toy.write("laws/other.py", other)
    call = "from toy.laws.other import half; extra['half'] = half(4.0)"
    toy.run()
    second = toy.run(call)
    assert (second["half"], second["compiled"]) == (10.0, ["toy.laws.other.half"])
    for file in toy.entries("callee.scale.linked*"):
        file.write_bytes(b"damaged")
    toy.write("laws/other.py", other.replace("0.5", "0.25"))
    third = toy.run(call)
    assert (third["half"], third["compiled"]) == (5.0, ["toy.laws.other.half", "toy.kernels.callee.scale"])
    toy.set_factor(7)
    assert toy.run(call)["half"] == 7.0


@pytest.mark.nightly
def test_edit_of_what_a_kernel_does_not_import_compiles_nothing(toy: Toy) -> None:
    toy.run()
    toy.write("laws/other.py", "from toy.kernels.jit import kernel\n")
    toy.write("plain/caller.py", PLAIN_CALLER + "\n    # edited\n")
    assert toy.run()["misses"] == 0


@pytest.mark.nightly
@pytest.mark.parametrize(
    "statement",
    [
        "from toy.settings import FACTOR",
        "from toy.settings import (\n        OTHER,\n        FACTOR,\n    )",
        "import toy.settings\n    FACTOR = toy.settings.FACTOR",
        "from toy import settings\n    FACTOR = settings.FACTOR",
    ],
)
def test_edit_of_a_constant_anywhere_in_the_package_is_seen(toy: Toy, statement: str) -> None:
    toy.write("kernels/callee.py", f"    {statement}\n" + CALLEE)
    values = []
    for factor in (5.0, 7.0, 5.0):
        toy.write("settings.py", f"FACTOR = {factor}\nOTHER = 1.0\n")
        report = toy.run()
        values.append((report["value"], report["misses"] > 0))
    assert values == [(30.0, True), (42.0, True), (30.0, False)]


@pytest.mark.nightly
def test_order_of_the_fields_of_arguments_is_part_of_the_key(toy: Toy) -> None:
    """The class of an argument may be defined where the kernel's module does not look."""
    kernel = """
        from toy.kernels.jit import kernel

        @kernel
        def first(pair):
            return pair.first
    """
    toy.write("laws/first.py", kernel)
    call = "from toy.pair import Pair; from toy.laws.first import first; extra['first'] = first(Pair(first=1, second=2))"
    for fields in ("first: int\n    second: int", "second: int\n    first: int"):
        toy.write("pair.py", f"from typing import NamedTuple\nclass Pair(NamedTuple):\n    {fields}\n")
        assert toy.run(call)["first"] == 1


@pytest.mark.nightly
def test_copies_of_the_package_share_their_kernels(toy: Toy, tmp_path_factory: pytest.TempPathFactory) -> None:
    toy.run()
    copy = Toy(tmp_path_factory.mktemp("copy"))
    assert copy.run(NUMBA_CACHE_DIR=str(toy.cache))["misses"] == 0


@pytest.mark.nightly
def test_edit_during_the_run_is_not_stored_under_the_old_name(toy: Toy) -> None:
    callee = toy.root / "toy" / "kernels" / "callee.py"
    toy.run(f"open({str(callee)!r}, 'a').write('# edited'); integers()")
    assert len(toy.entries("caller.effort.code-*")) == 1  # of the two signatures the one before the edit


@pytest.mark.nightly
@pytest.mark.parametrize("setting", ["NUMBA_BOUNDSCHECK", "NUMBA_CPU_NAME"])
def test_options_are_part_of_the_key(toy: Toy, setting: str) -> None:
    value = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CPU_NAME": "generic"}[setting]
    assert toy.run()["misses"] == 2
    assert toy.run(**{setting: value})["misses"] == 2
    assert toy.run()["misses"] == 0


@pytest.mark.nightly
def test_unwritable_folder_is_one_warning(toy: Toy) -> None:
    (toy.root / "file").write_text("")
    report = toy.run(NUMBA_CACHE_DIR=str(toy.root / "file" / "cache"))  # even root cannot write there
    assert report["value"] == 30.0
    assert report["misses"] == 2
    assert report["folder"] is None
    assert len(toy.stderr.splitlines()) == 1
    assert "NUMBA_CACHE_DIR" in toy.stderr
    assert not list(toy.root.rglob("*.lock"))


@pytest.mark.nightly
def test_pure_python(toy: Toy) -> None:
    report = toy.run("extra['kind'] = type(effort).__name__", NUMBA_DISABLE_JIT="1")
    assert report["value"] == 30.0
    assert report["kind"] == "function"
    assert report["misses"] == 0
    assert report["folder"] is None
    assert toy.stderr == ""
    assert not toy.cache.exists()


@pytest.mark.nightly
@pytest.mark.parametrize("locators", ["", "InTreeCacheLocator"])
def test_other_users_of_numba_keep_their_settings(toy: Toy, locators: str) -> None:
    report = toy.run(
        "from toy.plain.caller import effort as plain\nplain(1.0); extra['plain'] = plain.stats.cache_path",
        NUMBA_CACHE_LOCATOR_CLASSES=locators,
    )
    assert report["config_kept"]
    ours = {path.parent for path in toy.entries()} - {Path(report["plain"])}
    assert ours
    assert all(path.is_relative_to(report["folder"]) for path in ours)
    assert not Path(report["plain"]).is_relative_to(report["folder"])


@pytest.mark.nightly
def test_entry_of_another_signature_is_refused(toy: Toy) -> None:
    """Its file may have been renamed."""
    integers = "extra['integers'] = integers()"
    toy.run(integers)
    first, second = toy.entries("caller.effort.code-*")
    first.rename(first.with_name("swap"))
    second.rename(first)
    first.with_name("swap").rename(second)

    report = toy.run(integers)
    assert (report["value"], report["integers"]) == (30.0, 30.0)
    assert report["compiled"].count("toy.laws.caller.effort") == 2
    assert toy.run(integers)["misses"] == 0


@pytest.mark.nightly
def test_damaged_entries_are_replaced(toy: Toy) -> None:
    toy.run()
    for path in toy.entries():
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    report = toy.run()
    assert (report["value"], report["misses"]) == (30.0, 1)  # the code of the callee is another entry
    assert toy.run()["misses"] == 0


@pytest.mark.nightly
def test_processes_side_by_side(toy: Toy) -> None:
    with ThreadPoolExecutor(3) as pool:
        reports = list(pool.map(lambda _: toy.run(), range(3)))
    assert [report["value"] for report in reports] == [30.0] * 3
    assert sum(report["misses"] for report in reports) == 2  # one process compiles, the others wait for its entry
    assert toy.run()["misses"] == 0


@pytest.mark.nightly
def test_time_of_waiting_counts_as_time_of_compilation(toy: Toy) -> None:
    """Another process holds the lock of a kernel for a while, and then ends without an entry."""
    toy.run()
    (entry,) = toy.entries("*.lock")
    for stored in (*toy.entries(), *toy.entries("*.linked-*")):
        stored.unlink()
    take = f"f = open({str(entry)!r}); fcntl.flock(f, fcntl.LOCK_EX)"
    hold = f"import fcntl, time; {take}; print(flush=True); time.sleep(5)"
    with subprocess.Popen([sys.executable, "-c", hold], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        report = toy.run()
    assert report["misses"] == 2
    assert report["compile_time"] > report["clock"] + 1.0


@pytest.mark.nightly
def test_folders_out_of_use_are_removed(toy: Toy) -> None:
    parent = toy.cache / "toy" / "kernels"
    aged = {name: parent / name for name in ("a" * 20, "b" * 20, "c" * 20 + ".old-" + "0" * 32, "not-ours")}
    for folder in aged.values():
        folder.mkdir(parents=True)
        (folder / ".last_used").touch()
    now = time.time()
    for name, days in (
        ("a" * 20, 31),
        ("b" * 20, 29),
        ("c" * 20 + ".old-" + "0" * 32, 31),
        ("not-ours", 400),
    ):
        os.utime(aged[name] / ".last_used", (now - 86400 * days,) * 2)
    (toy.root / "elsewhere").mkdir()
    (parent / ("d" * 20)).symlink_to(toy.root / "elsewhere")
    os.utime(toy.root / "elsewhere", (now - 86400 * 400,) * 2)

    toy.run()
    ours = {path.parent.name for path in (*toy.entries(), *toy.entries("*.linked-*"))}
    left = {path.name for path in parent.iterdir()}
    assert left == {"b" * 20, "not-ours", "d" * 20, ".last_used"} | ours
    assert len(ours) == 2  # of the caller, and of the callee that it links
    assert (toy.root / "elsewhere").exists()


@pytest.mark.nightly
def test_folder_in_use_is_dated_once_a_day(toy: Toy) -> None:
    toy.run()
    stamp = toy.entries()[0].parent / ".last_used"
    for hours, redated in ((23, False), (25, True)):
        then = time.time() - 3600 * hours
        os.utime(stamp, (then, then))
        toy.run()
        assert (stamp.stat().st_mtime > then + 60) is redated


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("variable", "value", "expected"),
    [("XDG_CACHE_HOME", "ROOT/xdg", "ROOT/xdg"), ("XDG_CACHE_HOME", "relative", "ROOT/home/.cache")],
)
@pytest.mark.skipif(sys.platform != "linux", reason="the rule of Linux")
def test_user_cache_folder(toy: Toy, variable: str, value: str, expected: str) -> None:
    root = str(toy.root)
    report = toy.run(NUMBA_CACHE_DIR="", HOME=root + "/home", **{variable: value.replace("ROOT", root)})
    assert Path(report["folder"]) == Path(expected.replace("ROOT", root)) / "toy" / "kernels"


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX")
@pytest.mark.parametrize("place", [".", "..", "../..", "HASH"])
def test_folder_that_others_can_write_to_is_refused(toy: Toy, place: str) -> None:
    kernels = Path(toy.run()["folder"])
    open_to_all = toy.entries("caller*.code-*")[0].parent if place == "HASH" else (kernels / place).resolve()
    open_to_all.chmod(0o777)
    report = toy.run()
    assert (report["value"], report["misses"]) == (30.0, 1 if place == "HASH" else 2)  # the callee has another folder
    assert str(open_to_all) in toy.stderr
    assert "chmod go-w" in toy.stderr
    open_to_all.chmod(0o755)
    assert toy.run()["misses"] == 0


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() != 0, reason="only root can give folders away")
def test_folder_of_another_user_is_refused(toy: Toy) -> None:
    kernels = Path(toy.run()["folder"])
    os.chown(kernels, 65534, 65534)
    assert toy.run()["misses"] == 2
    assert "belongs to user 65534" in toy.stderr


@pytest.mark.nightly
def test_folders_are_the_users_own(toy: Toy) -> None:
    before = os.umask(0)
    try:
        kernels = Path(toy.run()["folder"])
    finally:
        os.umask(before)
    for folder in (kernels, *(path for path in kernels.iterdir() if path.is_dir())):
        assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.nightly
def test_kernel_outside_of_the_package_is_not_cached(toy: Toy) -> None:
    (toy.root / "mine.py").write_text(
        "from toy.kernels.callee import scale\nfrom toy.kernels.jit import kernel\n"
        "@kernel\ndef mine(x):\n    return 2.0 * scale(x)\n"
    )
    for _ in range(2):
        report = toy.run("from mine import mine; extra['mine'] = mine(1.0)")
        assert report["mine"] == 10.0
        assert "mine.mine" in report["compiled"]
    assert not toy.entries("mine.*")


RELATIVE = """
    from ..kernels.jit import kernel

    @kernel
    def identity(x):
        return x
"""
INNER = """
    from toy.kernels.jit import kernel

    def make(factor):
        @kernel
        def times(x):
            return factor * x
        return times

    double = make(2.0)
"""


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("module", "text", "complaint"),
    [("laws.near", RELATIVE, "import by full names"), ("laws.inner", INNER, "top level of the module")],
)
def test_kernel_that_the_hash_cannot_cover_is_refused(toy: Toy, module: str, text: str, complaint: str) -> None:
    name = module.replace(".", "/") + ".py"
    toy.write(name, text)
    attempt = f"""
        try:
            import toy.{module}
        except RuntimeError as fault:
            extra["fault"] = str(fault)
    """
    fault = toy.run(attempt)["fault"]
    assert complaint in fault
    assert name in fault


@pytest.mark.nightly
def test_callback_is_forgotten(toy: Toy) -> None:
    report = toy.run("forget(); forget(); integers()")
    assert report["compiled"] == KERNELS
    assert report["misses"] > 2
