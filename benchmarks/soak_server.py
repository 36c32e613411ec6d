"""The server of `soak.py`, and what is seen of it from outside."""

from __future__ import annotations

import json
import os
import re
import urllib.request
from pathlib import Path

from cohaptic_tools.demo.processes import Process

# Rooms and their bodies; the processes of the first two are never killed.
BODIES = {"calm": "balloon", "spring": "spring", "stormy": "balloon", "killed": "balloon"}
ROOMS = tuple(BODIES)
CALM, STORMY = ROOMS[:2], ROOMS[2:]
CONFIG = """
port = 0
[limits]
connections = "100:400"
joins = "50:200"
"""


class Server:
    """`cohaptic serve --config`, and what is seen of it from outside."""

    def __init__(self, folder: Path) -> None:
        self.log, path = folder / "server.log", folder / "rooms.toml"
        rooms = "".join(
            f'[rooms.{room}]\nbody = "{body}"\n[rooms.{room}.limits]\njoins = "50:200"\n'
            for room, body in BODIES.items()
        )
        path.write_text(CONFIG + rooms)
        self.process = Process("serve", "--config", str(path), log=self.log)
        self.url = self.process.first_line().removeprefix("listening ")

    def room(self, name: str) -> str:
        """Address of a room."""
        return f"{self.url}/r/{name}"

    def pid(self, room: str) -> int:
        """Process of a room now."""
        found = re.findall(rf"room {room} is open, process (\d+)", self.log.read_text())
        return int(found[-1])

    def states(self) -> dict[str, tuple[str, int]]:
        """State and users of each room."""
        with urllib.request.urlopen(self.url.replace("ws", "http", 1) + "/rooms") as answer:
            return {
                room["name"]: (room["state"], room["users"]) for room in json.load(answer)["rooms"]
            }

    def memory(self) -> dict[str, int]:
        """Resident memory of the rooms server and of the rooms that were never killed [bytes]."""
        pids = {"supervisor": self.process.pid} | {room: self.pid(room) for room in CALM}
        return {name: resident(pid) for name, pid in pids.items()}

    def faults(self) -> list[str]:
        """Lines of its log that should not be there."""
        words = ("Traceback", "never retrieved", "the room ends", "exception")
        return [line for line in self.log.read_text().splitlines() if any(w in line for w in words)]


def resident(pid: int) -> int:
    """Resident memory of a process [bytes]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
