"""`cohaptic-client`, built and installed as by who only touches (`client/client_build.py`)."""

from __future__ import annotations

import subprocess
import sys
import venv
from pathlib import Path
from subprocess import PIPE, STDOUT

import pytest

from tests.give_up import give_up
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

ROOT = Path(__file__).parents[1]
PIP = ["-m", "pip", "--disable-pip-version-check", "--quiet"]


def run(*command: object, status: int = 0) -> str:
    """What a command prints; it has to end with a status."""
    words = [str(word) for word in command]
    done = subprocess.run(words, text=True, stdout=PIPE, stderr=STDOUT, timeout=3 * PATIENCE)
    assert done.returncode == status, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the programs of a new environment with the package, its dependencies from pip."""
    folder = tmp_path_factory.mktemp("client")
    build = [*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder]
    run(sys.executable, *build, ROOT / "client")
    (wheel,) = folder.glob("cohaptic_client-*-py3-none-any.whl")
    venv.create(folder / "venv", with_pip=True)
    there = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    command = [str(there / "python"), *PIP, "install", str(wheel)]
    done = subprocess.run(command, text=True, stdout=PIPE, stderr=STDOUT, check=False)
    if done.returncode:
        give_up(f"pip cannot install it here: {done.stdout}")
    return there


def test_it_touches_a_server_and_has_nothing_of_one(scripts: Path) -> None:
    here = run(scripts / "python", "-m", "pip", "list").lower().replace("-", "_")
    assert "cohaptic_client" in here
    for name in ("scipy", "trimesh", "segno", "prometheus_client", "pyjwt", "threadpoolctl"):
        assert name not in here
    run(scripts / "python", "-m", "pip", "check")
    assert "--device" in run(scripts / "cohaptic", "touch", "--help")
    serve = [sys.executable, "-m", "cohaptic", "serve", "--port", "0"]
    with subprocess.Popen(serve, text=True, stdout=PIPE, stderr=STDOUT) as server:
        assert server.stdout is not None
        said = ""
        while "listening" not in said:
            said = server.stdout.readline()
            assert said, "the server has ended"
        url = next(word for word in said.split() if word.startswith("ws://"))
        try:
            reported = run(scripts / "cohaptic", "touch", url, "--duration", "2")
        finally:
            server.terminate()
    assert "touched for" in reported


def test_a_command_of_the_server_says_what_to_install(scripts: Path) -> None:
    reported = run(scripts / "cohaptic", "serve", status=2)
    assert reported.startswith("cohaptic: the command is serve; it must be one of cohaptic-client")
    assert "pip uninstall cohaptic-client, then pip install cohaptic" in reported
