"""Settings of a server's access control and encryption, and the proxies that the server trusts."""

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
    """Access control and encryption of one server; by default, open to anybody, no encryption.

    Args:
        admission: Decides which clients may come in.
        certificate: Certificate for TLS; None without TLS.
        proxies: Addresses and networks of trusted proxies, which say where a connection comes from.
        watched: Files that the server reads again when they change.
        state: Folder for bans and used tokens, which outlive the process; None stores nothing.
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
