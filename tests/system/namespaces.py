"""Network namespaces with cables between them: several machines, as far as a network goes."""

from __future__ import annotations

import contextlib
import ctypes
import os
import secrets
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

from tests.give_up import give_up
from tests.patience import PATIENCE

SERVER, GUEST = "10.203.77.1", "10.203.77.2"  # nobody else's: both are inside
_LAN = "10.204.77"
# Ray keeps its sockets here, whose paths may not be longer. Two Rays may not have it in common.
_OF_RAY = Path("/tmp/ray")


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


@dataclass(frozen=True, slots=True)
class Machine(Namespace):
    """One of several machines on a switch, with temporary files and processes of its own.

    Args:
        port: Of its cable at the switch.
        folder: Of its temporary files.
    """

    port: str
    folder: Path

    def command(self, *command: str) -> list[str]:
        """A command that runs on it."""
        # The shell is the first process there, and waits for orphans.
        inside = f'mount --bind {self.folder} {_OF_RAY} && "$@"; exit $?'
        own = ("unshare", "--pid", "--fork", "--mount-proc")
        return ["ip", "netns", "exec", self.name, *own, "sh", "-c", inside, "sh", *command]

    def numbered(self) -> dict[int, int]:
        """All its processes by their numbers there, with their numbers here."""
        found = dict[int, int]()
        for pid in self.pids():
            with contextlib.suppress(OSError):
                lines = Path(f"/proc/{pid}/status").read_text().splitlines()
                numbers = next(line.split()[1:] for line in lines if line.startswith("NSpid:"))
                if len(numbers) > 1:
                    found[int(numbers[-1])] = pid
        return found

    def pids(self) -> list[int]:
        """All its processes."""
        own, found = Path(f"/run/netns/{self.name}").stat().st_ino, list[int]()
        for folder in Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if folder.name.isdecimal() and (folder / "ns/net").stat().st_ino == own:
                    found.append(int(folder.name))
        return found

    def signal(self, number: signal.Signals) -> None:
        """To all its processes, as when it loses its power."""
        for pid in self.pids():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)

    def memory(self) -> float:
        """Of its processes, with shared pages divided among them [MB]."""
        total = 0
        for pid in self.pids():
            with contextlib.suppress(OSError):
                lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
                total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
        return total / 1e3

    def processor(self) -> float:
        """Processor time of its processes so far [s]."""
        ticks = 0
        for pid in self.pids():
            with contextlib.suppress(OSError):
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                ticks += int(fields[11]) + int(fields[12])
        return ticks / os.sysconf("SC_CLK_TCK")

    def plug(self, state: str) -> None:
        """Its cable: "up" or "down"; from within the namespace of the switch."""
        _ip("link", "set", self.port, state)


@contextlib.contextmanager
def machines(count: int, folder: Path) -> Generator[list[Machine]]:
    """Machines on a switch; meanwhile this thread is there too, and what it starts."""
    if sys.platform != "linux" or shutil.which("ip") is None:
        give_up("network namespaces need Linux and iproute2")
    tag = f"{os.getpid() % 100000}{secrets.token_hex(2)}"
    switch, made = f"cohaptic-h{tag}", list[str]()
    there = list[Machine]()
    _OF_RAY.mkdir(exist_ok=True)
    try:
        for name in (switch, *(f"cohaptic-{k}{tag}" for k in range(1, count + 1))):
            _ip("netns", "add", name)
            made.append(name)
        _ip("-n", switch, "link", "add", "switch", "type", "bridge")
        _ip("-n", switch, "addr", "add", f"{_LAN}.254/24", "dev", "switch")
        for k, name in enumerate(made[1:], start=1):
            own = folder / f"machine{k}"
            own.mkdir()
            one = Machine(name, f"{_LAN}.{k}", f"port{k}", own)
            peer = ("peer", "name", "cable", "netns", name)
            _ip("-n", switch, "link", "add", one.port, "type", "veth", *peer)
            _ip("-n", switch, "link", "set", one.port, "master", "switch", "up")
            _ip("-n", name, "addr", "add", f"{one.address}/24", "dev", "cable")
            _ip("-n", name, "link", "set", "lo", "up")
            _ip("-n", name, "link", "set", "cable", "up")
            there.append(one)
        for device in ("lo", "switch"):
            _ip("-n", switch, "link", "set", device, "up")
        with _inside(switch):
            yield there
    except PermissionError as error:
        give_up(str(error))
    finally:
        for one in there:
            one.signal(signal.SIGKILL)
        for name in made:
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)


@contextlib.contextmanager
def _inside(name: str) -> Generator[None]:
    """This thread in a namespace, and what it starts."""
    libc = ctypes.CDLL(None, use_errno=True)

    def enter(path: str) -> None:
        with Path(path).open("rb") as file:
            if libc.setns(file.fileno(), 0):
                raise PermissionError(os.strerror(ctypes.get_errno()))

    before = os.open("/proc/thread-self/ns/net", os.O_RDONLY)
    try:
        enter(f"/run/netns/{name}")
        yield
    finally:
        libc.setns(before, 0)
        os.close(before)
