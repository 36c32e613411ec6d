"""Two network namespaces with a cable between them: two machines, as far as a network goes."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import subprocess
import sys
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

from tests.give_up import give_up
from tests.patience import PATIENCE

SERVER, GUEST = "10.203.77.1", "10.203.77.2"  # nobody else's: both are inside


@dataclass(frozen=True, slots=True)
class Namespace:
    """One of them.

    Args:
        name: As `ip netns` knows it.
        address: Of its end of the cable.
    """

    name: str
    address: str

    def command(self, *command: str) -> list[str]:
        """A command that runs in it."""
        return ["ip", "netns", "exec", self.name, *command]

    def cohaptic(self, *arguments: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        """A command of cohaptic, to its end."""
        command = self.command(sys.executable, "-m", "cohaptic", *arguments)
        return subprocess.run(
            command, capture_output=True, text=True, check=check, timeout=PATIENCE
        )

    def wrap(self, program: str, script: Path) -> Path:
        """A script that starts a program in it, with its own files that are open."""
        script.write_text(f'#!/bin/sh\nexec ip netns exec {self.name} {program} "$@"\n')
        script.chmod(0o755)
        return script


@contextlib.contextmanager
def two_namespaces() -> Generator[tuple[Namespace, Namespace]]:
    """A server's and a guest's; skips the test where they cannot be made."""
    if sys.platform != "linux" or shutil.which("ip") is None:
        give_up("network namespaces need Linux and iproute2")
    tag = f"{os.getpid() % 100000}{secrets.token_hex(2)}"
    ends = [Namespace(f"cohaptic-s{tag}", SERVER), Namespace(f"cohaptic-g{tag}", GUEST)]
    made: list[Namespace] = []
    try:
        for end in ends:
            _ip("netns", "add", end.name)
            made.append(end)
        # Made inside, so that nothing of it is ever seen outside.
        first, second = ends
        peer = ("peer", "name", "cable", "netns", second.name)
        _ip("-n", first.name, "link", "add", "cable", "type", "veth", *peer)
        for end in ends:
            _ip("-n", end.name, "addr", "add", f"{end.address}/30", "dev", "cable")
            _ip("-n", end.name, "link", "set", "lo", "up")
            _ip("-n", end.name, "link", "set", "cable", "up")
        yield first, second
    except PermissionError as error:
        give_up(str(error))
    finally:
        for end in made:
            subprocess.run(["ip", "netns", "del", end.name], check=False, capture_output=True)


def _ip(*arguments: str) -> None:
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise PermissionError(f"no network namespace can be made here: {done.stderr.strip()}")
