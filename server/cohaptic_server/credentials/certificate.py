"""Loads, checks and reloads the TLS certificate of a server.

A handshake in memory checks that certificate and key work before anybody connects, since a client
could only report that something is wrong.
"""

from __future__ import annotations

import os
import ssl
from pathlib import Path
from typing import Any

from cohaptic.errors import SettingError

_EXPIRED, _NOT_YET = 10, 9  # verification codes of OpenSSL
_ALPN = ["http/1.1"]  # the only offer, so that browsers open websockets with HTTP/1.1


class Certificate:
    """A TLS certificate and its key in two files, and the TLS context that uses them.

    Args:
        cert: PEM file with the server's own certificate first, then its issuers' certificates.
        key: PEM file with the key, without a password.

    Attributes:
        context: TLS context of every connection; it uses the pair that was loaded last.
        paths: Paths of both files.
        ends: End of the certificate's validity, as the certificate states it.

    Raises:
        SettingError: The files cannot be used.
    """

    def __init__(self, cert: Path, key: Path) -> None:
        self.paths = (cert, key)
        self.context = self._newest = _context()
        _load(self.context, *self.paths)
        self.ends = _try_it(self.context, cert)
        # The callback runs at each handshake, with or without a server name. Loading new files into
        # a context in use would, for a moment, combine a new certificate with an old key.
        self.context.sni_callback = self._choose

    def load(self) -> None:
        """Load the files again.

        Raises:
            SettingError: The files cannot be used; the old pair stays in use.
        """
        fresh = _context()
        _load(fresh, *self.paths)
        self.ends = _try_it(fresh, self.paths[0])
        self._newest = fresh

    def _choose(self, connection: ssl.SSLObject, _name: str | None, _from: object) -> None:
        if self._newest is not self.context:
            connection.context = self._newest


def _context() -> ssl.SSLContext:
    # TLS 1.2 and 1.3 with the ciphers that Python chooses; no client certificate.
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    # A client must not make the server repeat the handshake again and again on one connection.
    context.options |= ssl.OP_NO_RENEGOTIATION
    context.set_alpn_protocols(_ALPN)
    return context


def _load(context: ssl.SSLContext, cert: Path, key: Path) -> None:
    for name, path in (("--tls-cert", cert), ("--tls-key", key)):
        if not os.access(path, os.R_OK) or not path.is_file():
            raise SettingError(name, path, "a file that can be read")
    try:
        # The callback prevents a password prompt, since a server has no terminal.
        context.load_cert_chain(cert, key, password=_no_password)
    except _Encrypted as error:
        limit = "one without a password: openssl pkey -in IN -out OUT"
        raise SettingError("--tls-key", key, limit) from error
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            raise SettingError("--tls-key", key, f"the key of the certificate in {cert}") from error
        limit = f"a pair of certificate and key in PEM ({error.reason or error})"
        raise SettingError("--tls-cert and --tls-key", f"{cert} and {key}", limit) from error
    except OSError as error:
        limit = f"a pair of files that can be read ({error.strerror})"
        raise SettingError("--tls-cert and --tls-key", f"{cert} and {key}", limit) from error


class _Encrypted(Exception):
    pass


def _no_password() -> str:
    raise _Encrypted


def _try_it(server: ssl.SSLContext, cert: Path) -> str:
    """Run a TLS handshake in memory, with the certificate itself as the trusted certificate.

    Returns:
        End of the certificate's validity.

    Raises:
        SettingError: The certificate has expired, is not valid yet, or does not work.
    """
    client = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False
    client.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    try:
        client.load_verify_locations(cert)
        found = _handshake(client, server)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code == _EXPIRED:
            raise SettingError("--tls-cert", f"{cert}, which has expired", "renewed") from error
        if error.verify_code == _NOT_YET:
            limit = "one that is valid: see the clock of this machine"
            raise SettingError("--tls-cert", f"{cert}, not valid yet", limit) from error
        limit = f"one for a server ({error.verify_message})"
        raise SettingError("--tls-cert", cert, limit) from error
    except ssl.SSLError as error:
        limit = f"a pair that can be used for TLS ({error.reason or error})"
        raise SettingError("--tls-cert", cert, limit) from error
    return str(found.get("notAfter", ""))


def _handshake(client: ssl.SSLContext, server: ssl.SSLContext) -> dict[str, Any]:
    """Run the handshake, and return the certificate that the client has verified, or {}."""
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    there = client.wrap_bio(to_client, to_server)
    here = server.wrap_bio(to_server, to_client, server_side=True)
    waiting = [there, here]
    for _ in range(10):
        for side in list(waiting):
            try:
                side.do_handshake()
            except ssl.SSLWantReadError:
                continue
            waiting.remove(side)
        if not waiting:
            break
    return there.getpeercert() or {}
