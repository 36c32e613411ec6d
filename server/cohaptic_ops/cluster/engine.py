"""Runs the engine's programs on this machine, and keeps what it tells of the rooms' places.

Two programs run beside the server. `machine` makes this machine a part of the engine, and ends with
the server. `agent` speaks with the engine; only witnesses run it, since one of them decides.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import logging
import os
import re
import socket
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from cohaptic.clock import Clock
from cohaptic.errors import SettingError
from cohaptic_ops.cluster import machine
from cohaptic_ops.cluster.lines import LONGEST, Command, Placed
from cohaptic_ops.restarts import Restarts

log = logging.getLogger("cohaptic.server")

_AGAIN: Final = 1.0  # s; a program takes a second of a core to start
_LONGEST: Final = 4.0  # s beside it, after many ends: while no head runs, lost rooms wait
_KILLED_WITHIN: Final = 1.0  # s
# Lines of the programs that say why they end; others are parts of traces, and hints.
_REASON: Final = re.compile(rb"Error\b|already running|refused", re.IGNORECASE)
_FRESH: Final = 3.0  # s for which the engine counts as reached after its last word
_STARTS: Final = 20.0  # s that it has for its start; about 6 s on a machine at rest
# Ray takes a machine for dead after three checks in half-second steps have failed (by default after
# 18 s). A machine whose head is gone for 60 s is started again, and then finds a head that has
# another address under the same name.
_SETTINGS: Final = {
    "health_check_initial_delay_ms": 500,
    "health_check_period_ms": 500,
    "health_check_timeout_ms": 500,
    "health_check_failure_threshold": 3,
}


class Engine:
    """The engine as this node sees it.

    Args:
        address: Address of the engine's head, HOST:PORT.
        host: Address of this machine.
        clock: Clock of the node.
        leads: Whether the head runs on this machine.
        watches: Whether this node asks where rooms are placed.

    Attributes:
        placed: Machine (IP address) of each room; empty for one without a machine. It stays as it
            was while the engine cannot be reached.

    Raises:
        SettingError: The engine is not installed.
    """

    def __init__(
        self, address: str, host: str, clock: Clock, *, leads: bool, watches: bool
    ) -> None:
        self._address, self._clock = address, clock
        self._start, self._leads = start_command(address, host, leads=leads), leads
        self._watches = watches
        self._report = ""
        self.placed: Mapping[str, str] = {}
        self._on: dict[str, list[str]] = {}
        self._begun, self._heard = clock.now(), float("-inf")
        self._agent: asyncio.subprocess.Process | None = None
        self._machine: asyncio.subprocess.Process | None = None
        self._leaves = False
        if not _program().is_file():
            limit = "used with the extra: pip install 'cohaptic[cluster]'"
            raise SettingError("--cluster", address, limit)

    @property
    def reached(self) -> bool:
        """Whether the engine has been heard lately."""
        return self._clock.now() - self._heard < _FRESH

    @property
    def away(self) -> bool:
        """Whether it has not, and had the time to start: rooms have to be placed without it."""
        return self._clock.now() - max(self._heard, self._begun + _STARTS) >= _FRESH

    def tell(self) -> None:
        """Log whether the engine answers, when that changes; only who watches it knows."""
        state = "answers" if self.reached else "away" if self.away else self._report
        if not self._watches or state == self._report:
            return
        self._report, reported = state, {"event": f"engine_{state}"}
        if state == "answers":
            log.info("the engine at %s answers", self._address, extra=reported)
        else:
            words = "the engine at %s does not answer; is that the first machine, and does it run?"
            log.warning(words + " Witnesses place rooms meanwhile", self._address, extra=reported)

    def on(self, host: str) -> Sequence[str]:
        """Return the rooms that the engine has placed on a machine."""
        return self._on.get(host, ())

    def command(self, command: Command) -> None:
        """Send a command without waiting; it is lost while the program does not run."""
        process = self._agent
        if process is not None and process.stdin is not None and process.returncode is None:
            process.stdin.write(command.model_dump_json().encode() + b"\n")

    def beat(self) -> None:
        """Send a heartbeat to the machine's program, which ends the engine without heartbeats."""
        process = self._machine
        if process is not None and process.stdin is not None and not process.stdin.is_closing():
            process.stdin.write(b".")

    async def keep(self) -> None:
        """Run both programs, again and again, until cancelled."""
        programs = [self._keep_machine()]
        if self._watches:
            programs.append(self._keep_agent())
        await asyncio.gather(*programs)

    async def leave(self) -> None:
        """Take this machine out of the engine, so that it places no rooms here any more."""
        self._leaves = True
        await _end(self._machine, machine.ENDS_WITHIN + 1.0)

    async def stop(self) -> None:
        """End both programs; `keep` must have been cancelled."""
        await self.leave()
        await _end(self._agent, 1.0)

    async def _keep_machine(self) -> None:
        restarts = Restarts()
        while not self._leaves:
            begun, last = self._clock.now(), b""
            port = self._address.rpartition(":")[2]
            if self._leads and _is_taken(int(port)):
                last = f"its port {port} is taken by another program".encode()
            else:
                with contextlib.suppress(OSError):  # no process can be started now
                    process = self._machine = await _run("machine", *self._start)
                    last = await self._read(process, lambda line: False)
            if not self._leaves:
                reported = {"event": "engine_ended"}
                words = "the engine has ended here, and is started again: %s"
                log.warning(words, last.decode(errors="replace")[:300], extra=reported)
            restarts = restarts.ended(begun, self._clock.now())
            await asyncio.sleep(_AGAIN + min(restarts.pause, _LONGEST))

    async def _keep_agent(self) -> None:
        restarts = Restarts()
        while True:
            begun, last = self._clock.now(), b""
            with contextlib.suppress(OSError):
                process = self._agent = await _run("agent", self._address)
                last = await self._read(process, self.hear)
            reported = {"event": "engine_lost"}
            words = "the engine at %s cannot be reached: %s"
            log.warning(words, self._address, last.decode(errors="replace")[:300], extra=reported)
            restarts = restarts.ended(begun, self._clock.now())
            await asyncio.sleep(_AGAIN + min(restarts.pause, _LONGEST))

    def hear(self, line: bytes) -> bool:
        """Take a line of the agent; return whether it is one of its messages."""
        try:
            placed = Placed.model_validate_json(line)
        except ValidationError:
            return False
        self.placed = {**self.placed, **placed.rooms} if placed.more else placed.rooms
        self._on = {}
        for room, host in self.placed.items():
            self._on.setdefault(host, []).append(room)
        self._heard = self._clock.now()
        return True

    async def _read(
        self, process: asyncio.subprocess.Process, hear: Callable[[bytes], bool]
    ) -> bytes:
        """Read a program's lines to its end; return the last one that names an error."""
        last = b"it gave no reason"
        assert process.stdout is not None
        assert process.stdin is not None
        try:
            async for line in process.stdout:
                if not hear(line) and _REASON.search(line):
                    last = line.strip()
        except ValueError:  # a line without an end
            process.kill()
        finally:
            process.stdin.close()  # either program ends then
        return last


def start_command(address: str, host: str, *, leads: bool) -> Sequence[str]:
    """Return the command that makes a machine a part of the engine.

    Args:
        address: Address of the engine's head, HOST:PORT.
        host: Address of the machine.
        leads: Whether it is the machine of the head.
    """
    command = [str(_program()), "start", "--block", f"--node-ip-address={host}"]
    command.append("--disable-usage-stats")
    if not leads:
        return [*command, f"--address={address}"]
    port, settings = address.rpartition(":")[2], json.dumps(_SETTINGS)
    return [
        *command, "--head", f"--port={port}", "--include-dashboard=false",
        f"--system-config={settings}",
    ]  # fmt: skip


def _is_taken(port: int) -> bool:
    """Whether a program listens at a port already; Ray would wait for a minute, and not say so."""
    try:
        socket.create_server(("", port)).close()
    except OSError as error:
        return error.errno == errno.EADDRINUSE
    return False


def _program() -> Path:
    return Path(sys.executable).with_name("ray")


def environment(own: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of the engine's programs: with a token where this machine has one.

    Left to itself, Ray asks for a token at its head if there is one, and sends none elsewhere.

    Args:
        own: Environment of this process.
    """
    named = own.get("RAY_AUTH_TOKEN") or own.get("RAY_AUTH_TOKEN_PATH")
    has_token = bool(named) or Path.home().joinpath(".ray", "auth_token").is_file()
    return {"RAY_AUTH_MODE": "token" if has_token else "disabled", **own}


async def _run(name: str, *arguments: str) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        sys.executable, "-m", f"cohaptic_ops.cluster.{name}", *arguments,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT, limit=LONGEST, env=environment(os.environ),
    )  # fmt: skip


async def _end(process: asyncio.subprocess.Process | None, within: float) -> None:
    """Let a program end, which it does when its standard input closes; kill it after a time [s]."""
    if process is None:
        return
    if process.stdin is not None:
        process.stdin.close()
    try:
        async with asyncio.timeout(within):
            await process.wait()
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        with contextlib.suppress(TimeoutError):  # what it has started may hold its output open
            async with asyncio.timeout(_KILLED_WITHIN):
                await process.wait()
