"""`cohaptic serve` as people and scripts start it. Where it starts it is a process: few, short."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from collections.abc import Callable

import pytest

from tests.patience import PATIENCE

pytestmark = pytest.mark.live

SERVE = [sys.executable, "-m", "cohaptic", "serve"]
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")


def test_a_port_in_use_is_one_sentence_with_a_way_out() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = refused("--port", str(port))
    words = f"cohaptic: port is {port}, which is in use on 127.0.0.1; it must be a free one"
    assert done.stderr.startswith(words)
    assert "choose with --port" in done.stderr


@pytest.mark.parametrize("option", ["--record", "--recordings"])
def test_an_empty_path_of_a_recording_is_not_taken_for_none(option: str) -> None:
    """As `--record "$FILE"` of a script whose variable is not set."""
    done = refused(option, "", "--port", "0")
    assert f"{option} is empty; it must be the name of a file" in done.stderr


def refused(*arguments: str) -> subprocess.CompletedProcess[str]:
    """A server that cannot start, and says so in one line."""
    done = subprocess.run(
        [*SERVE, *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    return done


def interrupt(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)


def terminate(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGTERM)


def cut_the_lifeline(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.close()


@pytest.mark.parametrize(
    "end",
    [
        pytest.param(interrupt, marks=POSIX),
        pytest.param(terminate, marks=POSIX),
        cut_the_lifeline,
    ],
)
def test_a_server_says_where_it_listens_and_ends_cleanly(
    end: Callable[[subprocess.Popen[str]], None],
) -> None:
    with subprocess.Popen(
        [*SERVE, "--port", "0", "--lifeline"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stderr is not None
            first = process.stdout.readline()
            assert first.startswith("listening ws://127.0.0.1:")
            end(process)
            assert process.wait(PATIENCE) == 0
            assert process.stdout.read() == ""
            news = process.stderr.read().splitlines()
        finally:
            process.kill()
    assert f"cohaptic touch {first.split()[1]} --name NAME" in news[0]
    address = first.split()[1].replace("ws://", "http://")
    assert news[1].endswith(f" page {address}/")
    assert "stopped after" in news[-1]
    assert len(news) == 3


def test_a_start_imports_nothing_that_only_preparing_needs() -> None:
    """Each takes a third of a second, in the server and again in the process beside its ticks."""
    check = (
        "import sys; import cohaptic_server.cli.serving, cohaptic_server.shell.column_process;"
        "import cohaptic_server.objects.build, cohaptic_server.objects.build_rubber;"
        "print([m for m in ('trimesh', 'networkx', 'meshio', 'scipy.spatial') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", check], capture_output=True, text=True, timeout=PATIENCE, check=True
    )
    assert done.stdout == "[]\n"
