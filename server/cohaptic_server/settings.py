"""What a server can be told."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import SettingError


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """Settings of one server.

    Args:
        host: Address to listen on.
        port: TCP port; 0 lets the system choose.
        simulation_hz: Ticks per second, 1 / (N T).
        body: Name in the catalogue.
        max_users: Who may touch at once.
        allow_fixed_gains: Whether clients may choose gains themselves, unstable ones too.
    """

    host: str = "127.0.0.1"
    port: int = 8765
    simulation_hz: float = 60.0
    body: str = "balloon"
    max_users: int = 16
    allow_fixed_gains: bool = False

    def __post_init__(self) -> None:
        if not 10.0 <= self.simulation_hz <= 200.0:
            raise SettingError("simulation rate", f"{self.simulation_hz} Hz", "from 10 to 200 Hz")
        if not 0 <= self.port <= 65535:
            raise SettingError("port", self.port, "from 0 to 65535")
        if not 1 <= self.max_users <= 64:
            raise SettingError("max_users", self.max_users, "from 1 to 64")

    @property
    def simulation_period(self) -> float:
        """N T [s]."""
        return 1.0 / self.simulation_hz
