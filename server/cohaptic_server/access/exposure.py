"""Whether a server may listen where it is told to: strangers are let in by a decision alone."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass

from cohaptic.errors import SettingError


@dataclass(frozen=True, slots=True)
class Exposure:
    """Who reaches a server, and what it was told about that.

    Args:
        host: That it listens on.
        keys: Whether it has keys.
        open: Whether it was told to take in anybody.
        tls: Whether it has a certificate.
        insecure: Whether it was told to do without.
        behind_proxy: Whether a proxy brings strangers.
    """

    host: str
    keys: bool = False
    open: bool = False
    tls: bool = False
    insecure: bool = False
    behind_proxy: bool = False

    @property
    def is_local(self) -> bool:
        """Whether only this machine reaches it directly."""
        try:
            return ipaddress.ip_address(self.host.strip("[]")).is_loopback
        except ValueError:
            return self.host == "localhost"

    @property
    def admits_anybody(self) -> bool:
        """Whether one without a token comes in."""
        return self.open or not self.keys

    def check(self) -> None:
        """Raise SettingError, with what to type, where nobody has decided who may come in."""
        lacks: list[str] = []
        if not (self.keys or self.open) and (self.behind_proxy or not self.is_local):
            lacks.append("--keys FILE (made by: cohaptic key FILE) or --open for anybody")
        if not (self.tls or self.insecure) and not self.is_local:
            lacks.append("--tls-cert FILE --tls-key FILE or --insecure")
        if lacks:
            way = " through a proxy" if self.is_local else ""
            where = f"{self.host or 'every address'}, where other machines come in{way}"
            raise SettingError("host", where, f"given with {', and with '.join(lacks)}")
