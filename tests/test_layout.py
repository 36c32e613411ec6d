"""The layout holds for files that do not exist yet: import contracts by folder, and functions."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("shared", "server", "client", "experiments")
MAX_FUNCTION_LINES = 60


def sources() -> list[Path]:
    """Python files of the project and its tests."""
    folders = (*PACKAGES, "tests", "tools", "benchmarks", "examples")
    return [path for folder in folders for path in (ROOT / folder).rglob("*.py")]


def test_every_package_goes_into_the_wheel() -> None:
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    found = {
        str(init.parent.relative_to(ROOT))
        for p in PACKAGES
        for init in (ROOT / p).glob("*/__init__.py")
    }
    assert set(listed["targets"]["wheel"]["packages"]) == found


def test_a_function_above_60_lines_has_its_reason_above_it() -> None:
    for path in sources():
        text = path.read_text()
        lines = text.splitlines()
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                continue
            if node.end_lineno is None or node.end_lineno - node.lineno < MAX_FUNCTION_LINES:
                continue
            first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
            assert lines[first - 2].lstrip().startswith("#"), f"{path}: {node.name}"


@pytest.mark.live
@pytest.mark.parametrize(
    ("module", "line", "contract"),
    [
        ("cohaptic_server/bodies/jelly.py", "from cohaptic_server.world import tick", "bodies"),
        ("cohaptic_server/world/socket_of_one.py", "import asyncio", "no I/O"),
        ("cohaptic_server/attic/__init__.py", "X = 1", "attic"),
        ("cohaptic_client/loop/chat.py", "import websockets", "no I/O"),
        ("cohaptic_tools/demo/hand.py", "from cohaptic_client import client", "no client"),
        ("cohaptic_uploads/guests.py", "from cohaptic_ops import rooms", "each other"),
    ],
)
def test_a_new_module_that_breaks_a_contract_is_found(
    module: str, line: str, contract: str, tmp_path: Path
) -> None:
    for package in PACKAGES:
        shutil.copytree(
            ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("page", "__pycache__")
        )
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    side = "client" if module.startswith("cohaptic_client") else "server"
    added = tmp_path / side / module
    added.parent.mkdir(exist_ok=True)
    added.write_text(f'"""New."""\n\n{line}\n')
    path = os.pathsep.join(str(tmp_path / package) for package in PACKAGES)
    tool = Path(sys.executable).with_name("lint-imports")
    found = subprocess.run(
        [str(tool), "--no-cache"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode != 0
    assert contract in found.stdout
    assert "BROKEN" in found.stdout
