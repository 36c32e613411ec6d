"""What is public is said once, and is true."""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys
from pathlib import Path

import cohaptic
import cohaptic.testing

ROOT = Path(__file__).parents[1]


def test_all_names_what_is_there() -> None:
    for module in (cohaptic, cohaptic.testing):
        for name in module.__all__:
            assert hasattr(module, name)


def test_the_installed_version_is_the_codes() -> None:
    assert importlib.metadata.version("cohaptic") == cohaptic.__version__
    changelog = (ROOT / "CHANGELOG.md").read_text()
    newest = re.search(r"^## (\S+)", changelog, re.M)
    assert newest is not None
    assert newest[1] == cohaptic.__version__


def test_the_loops_process_starts_without_heavy_libraries() -> None:
    """Its imports are most of its start; the network's would also be the network's delays."""
    code = (
        "import cohaptic_client.loop.process, sys;"
        "print([m for m in ('numpy', 'pydantic', 'asyncio', 'websockets') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_client_starts_without_the_servers_libraries() -> None:
    code = (
        "import cohaptic.cli.app, sys; cohaptic.cli.app.build_app('touch');"
        "print([m for m in ('scipy', 'trimesh', 'cohaptic_server') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_command_line_lists_its_commands_and_its_version() -> None:
    run = [sys.executable, "-m", "cohaptic"]
    shown = subprocess.run([*run, "--help"], capture_output=True, text=True, check=True).stdout
    for command in ("demo", "serve", "touch"):
        assert command in shown
    version = subprocess.run([*run, "--version"], capture_output=True, text=True, check=True)
    assert version.stdout.strip() == f"cohaptic {cohaptic.__version__}"
    unknown = subprocess.run([*run, "dance"], capture_output=True, text=True)
    assert unknown.returncode == 2
    assert "dance" in unknown.stderr
