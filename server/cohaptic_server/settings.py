"""Settings of a server, with their ranges."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from cohaptic.control.law import Law
from cohaptic.errors import SettingError
from cohaptic.room_address import MAIN, base_path
from cohaptic_server.guard.limits import Limits

_FRAMING = re.compile(r"https?://([A-Za-z0-9._-]{1,253}|\[[0-9A-Fa-f:.]{2,45}\])(:\d{1,5})?")


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """Settings of one server.

    Args:
        host: Address to listen on.
        port: TCP port; 0 lets the system choose.
        simulation_hz: Ticks per second: the inverse of the simulation period N T [Hz].
        body: Name of a body in the catalogue, or path of a mesh file.
        max_users: Largest number of users at a time.
        allow_fixed_gains: Whether clients may choose their gains, including unstable ones.
        allow_latency: Whether watchers may inject latency between users and the server.
        max_watchers: Largest number of watchers at a time.
        allow_origins: Further origins whose pages may open a websocket, such as
            `https://lab.example`.
        allow_upload: Whether a page that is opened on this machine may upload an object.
        allow_hosts: Further names under which browsers may reach this server, such as
            `lab.example`; loopback names and listening addresses need not be listed.
        limits: Budgets (rate limits) of a connection and of an address.
        laws: Control laws that users may choose.
        room: Name of the room in its URL; None for settings that several rooms share.
        max_waiting: Largest number of clients in the queue for a full room; 0 for no queue.
        allow_frames: Origins whose pages may show the server's page in a frame, in the form of
            `allow_origins`.
        watchers_point: Whether watchers may point at the surface, too.
        base_path: Path below which a proxy offers the server, such as `/haptics`; empty for root.
        record: Session file (`.mcap`) to which the session is recorded from its beginning, or a
            folder in which the file gets a name of its own; empty for none.
        recordings: Folder in which an administrator of the room can record it; empty for none.
        made_from: How the body was made, by names of options of `cohaptic serve`, so that whoever
            has a recording can make it again.

    Raises:
        SettingError: A value is out of its range.
    """

    host: str = "127.0.0.1"
    port: int = 8765
    simulation_hz: float = 60.0
    body: str = "balloon"
    max_users: int = 16
    allow_fixed_gains: bool = False
    allow_latency: bool = False
    max_watchers: int = 100
    allow_origins: tuple[str, ...] = ()
    allow_upload: bool = False
    allow_hosts: tuple[str, ...] = ()
    limits: Limits = field(default_factory=Limits)
    laws: tuple[Law, ...] = tuple(Law)
    room: str | None = MAIN
    max_waiting: int = 16
    allow_frames: tuple[str, ...] = ()
    watchers_point: bool = True
    base_path: str = ""
    record: str = ""
    recordings: str = ""
    made_from: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __post_init__(self) -> None:
        if not 10.0 <= self.simulation_hz <= 200.0:
            raise SettingError("simulation rate", f"{self.simulation_hz} Hz", "from 10 to 200 Hz")
        if not 0 <= self.port <= 65535:
            raise SettingError("port", self.port, "from 0 to 65535")
        if not 1 <= self.max_users <= 64:
            raise SettingError("max_users", self.max_users, "from 1 to 64")
        if not 0 <= self.max_watchers <= 1000:
            raise SettingError("max_watchers", self.max_watchers, "from 0 to 1000")
        if not 0 <= self.max_waiting <= 64:
            raise SettingError("max_waiting", self.max_waiting, "from 0 to 64")
        if base_path(self.base_path) != self.base_path:
            raise SettingError("base_path", repr(self.base_path), "without a slash at its end")
        for origin in self.allow_origins:
            if not re.fullmatch(r"https?://[^/\s@]+", origin):
                limit = "a scheme, a host and a port if it has one: https://lab.example:8443"
                raise SettingError("origin", repr(origin), limit)
        for origin in self.allow_frames:
            # The origin becomes part of a header: no blank, semicolon, comma, quote or star.
            if not _FRAMING.fullmatch(origin):
                limit = "a scheme, a host and a port if it has one: https://lab.example:8443"
                raise SettingError("frame", repr(origin[:100]), limit)
        for host in self.allow_hosts:
            if not re.fullmatch(r"(\*?\.)?[A-Za-z0-9._-]{1,253}|\[[0-9A-Fa-f:.]+\]", host):
                limit = (
                    "a name or an address without a port, lab.example, or all below: .lab.example"
                )
                raise SettingError("host", repr(host), limit)

    @property
    def simulation_period(self) -> float:
        """Time N T between two ticks of the simulation [s]."""
        return 1.0 / self.simulation_hz
