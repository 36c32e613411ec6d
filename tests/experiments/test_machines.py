"""Parts of an experiment on a cluster of one machine, by a process that speaks with its engine."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path

import pytest

from cohaptic_ops.cluster.engine import environment, start_command
from tests.patience import PATIENCE
from tests.system.namespaces import Machine, machines

pytestmark = pytest.mark.live

# Its arguments are an address of an engine, or none, and the path of a flag.
SCRIPT = """
import math, os, signal, sys
from functools import partial
from pathlib import Path
from cohaptic_experiments.machines import machines

def dies_once(flag, part):
    if not flag.exists():
        flag.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return part**2

address, flag = sys.argv[1], Path(sys.argv[2])
with machines(address) as over:
    if not address:
        flag.touch()
    print(list(over(partial(dies_once, flag), range(20))))
    try:
        list(over(math.sqrt, [1.0, -1.0]))
    except ValueError as error:
        print(str(error).splitlines()[-1])
print("ray" in sys.modules)
"""
PORT = 6399
FOUND = str([k**2 for k in range(20)])


@pytest.fixture
def machine(tmp_path: Path) -> Generator[Machine]:
    """A machine with the head of an engine."""
    if importlib.util.find_spec("ray") is None:
        pytest.skip("the extra cluster")
    with machines(1, tmp_path) as (one,):
        process = _head(one)
        try:
            yield one
        finally:
            _end(one, process)


def _head(machine: Machine) -> subprocess.Popen[bytes]:
    """Start the engine's head; again where it gives up, as it does where all cores are in use."""
    command = start_command(f"{machine.address}:{PORT}", machine.address, leads=True)
    said = b""
    for _ in range(3):
        process = subprocess.Popen(
            machine.command(*command), stdout=subprocess.PIPE, env=environment(os.environ)
        )
        assert process.stdout is not None
        for line in process.stdout:
            if b"Ray runtime started" in line:
                return process
            said += line
        _end(machine, process)
    raise AssertionError(said.decode(errors="replace"))


def _end(machine: Machine, process: subprocess.Popen[bytes]) -> None:
    machine.signal(signal.SIGKILL)
    assert process.stdout is not None
    process.stdout.close()
    process.wait(PATIENCE)


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)


def _script(address: str, flag: Path) -> list[str]:
    return [sys.executable, "-c", SCRIPT, address, str(flag)]


def test_without_a_cluster_nothing_of_the_engine_is_imported(tmp_path: Path) -> None:
    done = _run(_script("", tmp_path / "flag"))
    squares, error, imported = done.stdout.splitlines()
    assert (squares, imported) == (FOUND, "False")
    assert "math domain error" in error


def test_results_come_in_order_though_a_process_is_lost(machine: Machine, tmp_path: Path) -> None:
    flag = machine.folder / "flag"
    # In its network only: Ray looks for the files of its session, which are those of the machine.
    inside = f'mount --bind {machine.folder} /tmp/ray && "$@"'
    script = _script(f"{machine.address}:{PORT}", flag)
    done = _run(["ip", "netns", "exec", machine.name, "sh", "-c", inside, "sh", *script])
    assert flag.exists()
    assert FOUND in done.stdout.splitlines()
    assert "math domain error" in done.stdout
    assert done.stdout.splitlines()[-1] == "True"


def test_a_cluster_that_is_not_there_is_named(tmp_path: Path) -> None:
    if importlib.util.find_spec("ray") is None:
        pytest.skip("the extra cluster")
    done = _run(_script("127.0.0.1:9", tmp_path / "flag"))
    assert "SettingError: --cluster is 127.0.0.1:9; it must be HOST:PORT" in done.stderr
