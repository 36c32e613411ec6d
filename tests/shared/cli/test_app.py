from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from tests.give_up import give_up
from tests.patience import PATIENCE

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


@pytest.mark.parametrize("name", ["COHAPTIC_KEYS", "COHAPTIC_TOKEN"])
def test_a_secret_that_is_there_and_empty_is_an_error_of_every_command(name: str) -> None:
    command = [sys.executable, "-m", "cohaptic", "serve", "--port", "0"]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, name: ""})
    assert done.returncode == 2
    assert f"the environment variable {name} is empty" in done.stderr


def test_no_file_of_the_folder_where_one_happens_to_be_is_run(tmp_path: Path) -> None:
    """Also by no process that a command starts: those of a demonstration, loops, an admin port."""
    for name in ("types", "struct", "token", "random", "cohaptic", "multiprocessing", "asyncio"):
        (tmp_path / f"{name}.py").write_text(f"open('{name} was run', 'w')\nraise SystemExit(7)\n")
    command = str(Path(sys.executable).with_name("cohaptic"))
    if not Path(command).exists():
        give_up(f"there is no {command}")
    run = partial(
        subprocess.Popen[str], cwd=tmp_path, text=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    with run([command, "serve", "--port", "0", "--admin", "0"]) as server:
        assert server.stdout is not None
        said = [server.stdout.readline()]
        while "listening" not in said[-1] and said[-1]:
            said.append(server.stdout.readline())
        server.terminate()
        assert server.wait(PATIENCE) == 0, said
    with run([command, "demo", "--duration", "4", "--no-browser"]) as shown:
        output, _ = shown.communicate(timeout=PATIENCE)
    assert list(tmp_path.glob("* was run")) == []
    assert "Traceback" not in output
    assert shown.returncode in (0, 1), output  # it judges what it has seen in so short a time


BROKEN = """
import sys, typer
from cohaptic.cli import app
from cohaptic.errors import SettingError
def build_app(only):
    made = typer.Typer()
    made.command("run")(command)
    made.command("other")(lambda: None)
    return made
app.build_app = build_app
def command():
    raise {error}
app.main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        ("IndexError('list index\\n out of range')", 70,
         "cohaptic: this is our bug: IndexError: list index? out of range; please report it;"
         " --traceback prints the traceback too"),
        ("RecursionError()", 70,
         "cohaptic: this is our bug: RecursionError: no reason is given; please report it;"
         " --traceback prints the traceback too"),
        ("OSError(28, 'No space left on device', '/dev/full')", 2,
         "cohaptic: the system says: No space left on device: /dev/full"),
        ("MemoryError()", 2,
         "cohaptic: the memory that this process may use does not suffice"),
        ("SettingError('--edge', 2, 'small')", 2, "cohaptic: --edge is 2; it must be small"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("asked", [False, True])
def test_an_error_is_one_sentence_and_the_whole_for_those_who_ask(
    error: str, status: int, said: str, asked: bool
) -> None:
    """The option stands anywhere on the line, and no command has to know of it."""
    words = ["run", "--traceback"] if asked else ["run"]
    code = [sys.executable, "-c", BROKEN.format(error=error), *words]
    done = subprocess.run(code, capture_output=True, text=True)
    *before, last = done.stderr.splitlines()
    assert done.returncode == status
    assert last == said
    assert any("Traceback" in line for line in before) == asked
    assert bool(before) == asked
