"""Compiled modules are used while they fit their sources; otherwise everything runs as Python."""

from __future__ import annotations

import ast
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cohaptic.compiled import MANIFEST, PYTHON
from compiling.build import CompileError, build, stale
from compiling.sources import module_path, units
from tests.client.devices.until import until
from tests.shared.loop_outputs import ROOT, outputs_of_a_loop
from tests.small_checkout import make_checkout, used_in

# Compiling takes 15 to 20 s of the processor, once: mypyc reads the types of the standard library.
pytestmark = [pytest.mark.live, pytest.mark.timeout(600)]

SHARED = ["cohaptic.control.mesh_fit"]  # of the packages that the checkout has a copy of
KERNELS = ["cohaptic_server.mean", "cohaptic_server.total"]
LOOP = ["cohaptic.vec", "cohaptic_client.tip"]
ALL = sorted(KERNELS + LOOP)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_checkout(tmp_path_factory.mktemp("checkout") / "root")


@pytest.fixture
def root(built: Path, tmp_path: Path) -> Path:
    """A compiled checkout to be spoiled."""
    return shutil.copytree(built, tmp_path / "root")


def folder(root: Path) -> Path:
    return root / "shared/cohaptic/_compiled" / PYTHON


def extension(root: Path, module: str) -> Path:
    (found,) = folder(root).glob(f"{module}-*")
    return found


def change(path: Path) -> None:
    path.write_text(path.read_text() + "\n# changed\n")


def test_what_was_compiled_is_used(root: Path) -> None:
    found = used_in(root)
    assert [sorted(group) for group in found["used"]] == [SHARED + KERNELS, LOOP]
    assert found["kernels"] == found["loop"] == "compiled"
    assert found["why_plain"] == ["", ""]
    assert found["plain"] == []


def test_a_kernel_whose_source_has_changed_is_plain(root: Path) -> None:
    change(root / "server/cohaptic_server/mean.py")
    found = used_in(root)
    assert found["plain"] == ["cohaptic_server.mean"]
    assert "compiled, except: cohaptic_server/mean.py has changed" in found["kernels"]
    assert found["why_plain"][0].startswith("cohaptic_server/mean.py has changed")
    assert found["why_plain"][1] == ""
    assert found["loop"] == "compiled"


def test_a_kernel_that_cannot_be_compiled_is_plain_and_named(root: Path) -> None:
    (root / "server/cohaptic_server/mean.pxd").write_text("cpdef nonsense mean(values)\n")
    with pytest.raises(CompileError, match=r"cohaptic_server\.mean could not be compiled"):
        build(root)
    found = used_in(root)
    assert found["plain"] == ["cohaptic_server.mean"]
    assert "except: cohaptic_server.mean was not compiled" in found["kernels"]
    # Once it can be, it is compiled, and what was not to blame was not compiled again.
    (root / "server/cohaptic_server/mean.pxd").unlink()
    assert build(root) == 0
    assert used_in(root)["kernels"] == "compiled"


@pytest.mark.parametrize(
    "source", ["shared/cohaptic/vec.py", "client/cohaptic_client/tip.py"]
)  # fmt: skip
def test_the_modules_of_the_loop_are_compiled_all_or_none(root: Path, source: str) -> None:
    change(root / source)
    found = used_in(root)
    assert sorted(found["plain"]) == LOOP
    assert found["loop"].startswith("plain Python: ")
    assert Path(source).name in found["loop"]


@pytest.mark.skipif(sys.platform == "win32", reason="one signal ends a group on POSIX only")
def test_a_build_that_is_ended_keeps_what_it_has_finished_and_the_next_goes_on_from_there(
    root: Path,
) -> None:
    shutil.copytree(ROOT / "compiling", root / "compiling")
    change(root / "server/cohaptic_server/mean.py")
    change(root / "client/cohaptic_client/tip.py")

    def finished() -> bool:
        return [unit.group for unit in stale(root)] == ["loop"]

    assert not finished()
    builds = subprocess.Popen(
        [sys.executable, "-m", "compiling"], cwd=root, stdout=subprocess.DEVNULL, process_group=0
    )
    with builds:
        until(finished, 300.0)  # the kernel; the loop takes 15 s of the processor
        os.killpg(builds.pid, signal.SIGKILL)
    assert finished()
    found = used_in(root)
    assert sorted(found["plain"]) == LOOP
    assert found["kernels"] == "compiled"


def test_the_demo_starts_when_what_it_needs_is_compiled(root: Path) -> None:
    shutil.rmtree(folder(root))
    assert build(root, first=True) == 4  # what kernels share, `mean`, `total` and the loop
    assert stale(root, first=True) == []
    found = used_in(root)
    assert found["plain"] == []
    assert found["why_plain"] == ["", ""]
    assert "except: cohaptic.control.mesh_fit was not compiled" in found["kernels"]
    assert build(root) == 1
    assert used_in(root)["kernels"] == "compiled"


@pytest.mark.parametrize(
    "text",
    [None, "", "{", "[]", "{}", '{"groups": []}', '{"groups": {}}', '{"groups": {"kernels": [1]}}',
     '{"groups": {"loop": [{"modules": {"cohaptic.vec": 1}, "files": {}, "sources": {}}]}}'],
)  # fmt: skip
def test_without_a_manifest_that_can_be_read_everything_is_plain(
    root: Path, text: str | None
) -> None:
    manifest = folder(root) / MANIFEST
    if text is None:
        manifest.unlink()
    else:
        manifest.write_text(text)
    found = used_in(root)
    assert sorted(found["plain"]) == ALL
    assert found["kernels"].startswith("plain Python: ")
    assert "compiled modules" in found["kernels"]
    assert found["why_plain"][0]


@pytest.mark.parametrize(
    ("module", "plain"),
    [
        ("cohaptic_server.mean", ["cohaptic_server.mean"]),
        ("cohaptic_cython", KERNELS),
        ("cohaptic_loop__mypyc", ["cohaptic_client.tip", "cohaptic.vec"]),
    ],
)
def test_an_extension_that_the_system_cannot_load_gives_way_to_its_source(
    root: Path, module: str, plain: list[str]
) -> None:
    path = extension(root, module)
    path.write_bytes(bytes(path.stat().st_size))
    found = used_in(root)
    assert found["plain"] == plain
    assert "cannot be loaded" in found["loop" if "loop" in module else "kernels"]


def test_the_loop_is_not_mixed_with_modules_imported_before(root: Path) -> None:
    found = used_in(root, before="import cohaptic.vec\n")
    assert found["loop"] == "plain Python: cohaptic.vec was imported before"
    assert sorted(found["plain"]) == LOOP


def test_the_loop_gives_the_same_compiled() -> None:
    plain, compiled = outputs_of_a_loop(compiled=False), outputs_of_a_loop(compiled=True)
    assert len(plain) == len(compiled) > 10_000
    for one, other in zip(plain, compiled, strict=True):
        assert one.keys() == other.keys()
        # To rounding: a compiler may put a product and a sum into one instruction.
        assert other == pytest.approx(one, rel=1e-12, abs=1e-12), one


def test_no_constant_of_the_loop_is_one_that_mypyc_cannot_read() -> None:
    """Of a `Final` tuple that begins with a float it says, where it is read, that it is not set."""
    (loop,) = (unit for unit in units(ROOT) if unit.group == "loop")
    for path in (module_path(ROOT, name) for name in loop.modules):
        assert path is not None
        for line in ast.parse(path.read_text()).body:
            if isinstance(line, ast.AnnAssign) and isinstance(line.value, ast.Tuple):
                first = ast.unparse(line.value.elts[0])
                is_float = "." in first and first.strip("-").replace(".", "").isdigit()
                assert not (is_float and "Final" in ast.unparse(line.annotation)), (path, first)
