"""Who a server takes in, how it is secured, and whom it believes about addresses."""

from __future__ import annotations

import ssl
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cohaptic_server.access.admission import Admission
from cohaptic_server.credentials.certificate import Certificate
from cohaptic_server.credentials.reloading import Watched


@dataclass(frozen=True, slots=True)
class Protection:
    """Protection of one server; without arguments, anybody comes in and nothing is encrypted.

    Args:
        admission: Whom it takes in.
        certificate: That it speaks TLS with; None for none.
        proxies: Addresses and networks whose word on where a connection comes from is believed.
        watched: Files to be read again when they change.
        state: Folder for what outlives a process: bans, and tokens that were used; None for none.
    """

    admission: Admission = field(default_factory=Admission)
    certificate: Certificate | None = None
    proxies: Sequence[str] = ()
    watched: Sequence[Watched] = ()
    state: Path | None = None

    @property
    def tls(self) -> ssl.SSLContext | None:
        """TLS settings of every connection; None without TLS."""
        return None if self.certificate is None else self.certificate.context
