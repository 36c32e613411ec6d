from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.live


def test_no_command_imports_what_its_help_does_not_need() -> None:
    """Help, and the error of a value that is none, come at once; `--help` loads all commands."""
    heavy = (
        "asyncio", "cryptography", "jwt", "matplotlib", "numba", "numpy", "prometheus_client",
        "pydantic", "pydantic_settings", "scipy", "segno", "ssl", "trimesh", "websockets",
    )  # fmt: skip
    code = (
        "import sys, typer.main; from cohaptic.cli.app import build_app;"
        "command = typer.main.get_command(build_app());"
        "assert {'serve', 'touch', 'experiment'} <= set(command.commands);"
        f"print([m for m in {heavy} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
