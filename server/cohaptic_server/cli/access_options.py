"""Command-line options for the access control and the encryption of a server.

A server accepts connections from other machines only if its owner has decided who may come in. This
module also reads durations, such as 10m.
"""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cohaptic.errors import SettingError
from cohaptic.written import at_home
from cohaptic_server.cli.option_groups import takes
from cohaptic_server.guard.proxies import NETWORK, network_of

if TYPE_CHECKING:
    from cohaptic_server.shell.limiter import Protection

_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_LONGEST = 400 * 86400.0  # s; a key is rotated sooner


def seconds_of(option: str, said: str, least: float = 1.0) -> float:
    """Convert the duration in an option's text, such as 10m, to seconds.

    Args:
        option: Name of the option, for the error.
        said: Text of the option, such as 10m.
        least: Shortest duration that is allowed [s].

    Raises:
        SettingError: The text is no duration, or the duration is too short or too long.
    """
    match = re.fullmatch(r"([0-9]{1,6}(?:\.[0-9]{1,3})?)([smhd])", said)
    seconds = float(match[1]) * _UNITS[match[2]] if match else -1.0
    if not least <= seconds <= _LONGEST:
        limit = f"from {least:g}s to 400d: 30s, 10m, 12h, 7d"
        raise SettingError(option, repr(said[:60]), limit)
    return seconds


InsecureKeyFile = Annotated[
    bool,
    typer.Option(
        "--insecure-key-file",
        help="Accept a file of keys that others can read: for file systems without modes.",
    ),
]


@dataclass(frozen=True, slots=True)
class AccessOptions:
    """Access options as the user has written them; each field is one option of the command line."""

    keys: Annotated[
        Path | None,
        typer.Option(
            envvar="COHAPTIC_KEYS",
            help="Let in only people with an invitation of these keys (`cohaptic key FILE`).",
        ),
    ] = None
    insecure_key_file: InsecureKeyFile = False
    open: Annotated[
        bool, typer.Option("--open", help="Let in anybody, also from other machines.")
    ] = False
    single_use: Annotated[
        bool, typer.Option("--single-use", help="Each invitation lets in one person, once.")
    ] = False
    session_valid: Annotated[
        str | None,
        typer.Option(
            help="Close a guest's session this long after its invitation ends: 0s, 1h. Without it a"
            " guest stays, and may come back for 12 h."
        ),
    ] = None
    tls_cert: Annotated[
        Path | None, typer.Option(help="Certificate (PEM), with those of its issuers behind it.")
    ] = None
    tls_key: Annotated[Path | None, typer.Option(help="Its key (PEM).")] = None
    insecure: Annotated[
        bool,
        typer.Option("--insecure", help="Listen without TLS where other machines can connect."),
    ] = False
    trust_proxy: Annotated[
        list[str] | None,
        typer.Option(
            help="Address or network of proxies whose X-Forwarded-For or Forwarded is believed:"
            " 127.0.0.1, 172.18.0.0/16."
        ),
    ] = None
    state: Annotated[
        Path | None,
        typer.Option(
            help="Folder that keeps bans and used invitations for when the server starts anew."
        ),
    ] = None

    def protection(self, host: str) -> Protection:
        """Read the files that these options name, and return the settings of access control.

        Args:
            host: Host name or address that the server listens on.

        Raises:
            SettingError: The options do not fit together, or a file cannot be used.
        """
        if (self.tls_cert is None) != (self.tls_key is None):
            given = self.tls_cert or self.tls_key
            raise SettingError("--tls-cert or --tls-key", given, "given together with the other")
        if self.single_use and self.keys is None:
            raise SettingError("--single-use", "given", "given with --keys, whose tokens it is of")
        if self.session_valid is not None and self.keys is None:
            limit = "given with --keys: without an invitation there is no end of one"
            raise SettingError("--session-valid", self.session_valid, limit)
        session_valid = None
        if self.session_valid is not None:
            session_valid = seconds_of("--session-valid", self.session_valid, least=0.0)
        exposure = Exposure(
            host,
            keys=self.keys is not None,
            open=self.open,
            tls=self.tls_cert is not None,
            insecure=self.insecure,
            behind_proxy=bool(self.trust_proxy),
        )
        exposure.check()
        from cohaptic_server.access.admission import Admission
        from cohaptic_server.credentials.certificate import Certificate
        from cohaptic_server.credentials.key_file import load_keys
        from cohaptic_server.credentials.reloading import Watched
        from cohaptic_server.shell.limiter import Protection

        watched: list[Watched] = []
        admission = Admission(
            None if self.keys is None else load_keys(self.keys, insecure=self.insecure_key_file),
            admits_anybody=exposure.admits_anybody,
            single_use=self.single_use,
            session_valid=session_valid,
        )
        if (keys := self.keys) is not None:

            def load() -> None:
                admission.ring = load_keys(keys, insecure=self.insecure_key_file)

            watched.append(Watched("the key file", (at_home(keys),), load))
        certificate = None
        if self.tls_cert is not None and self.tls_key is not None:
            certificate = Certificate(self.tls_cert, self.tls_key)
            watched.append(Watched("the certificate", certificate.paths, certificate.load))
        proxies = tuple(_proxy(said) for said in self.trust_proxy or ())
        return Protection(admission, certificate, proxies, tuple(watched), self.state)


def in_words_of(protection: Protection, host: str) -> list[str]:
    """Return sentences for the log about access, missing encryption and the certificate.

    Args:
        host: Host name or address that the server listens on.
    """
    lines: list[str] = []
    exposed = Exposure(host, behind_proxy=bool(protection.proxies))
    if not exposed.is_local or exposed.behind_proxy:
        if protection.admission.admits_anybody:
            lines.append(f"anybody who reaches {host} may touch")
        if protection.certificate is None and not exposed.is_local:
            lines.append(f"nothing on {host} is encrypted, tokens neither")
    if protection.certificate is not None:
        lines.append(f"the certificate is good until {protection.certificate.ends}")
    return lines


def _proxy(said: str) -> str:
    try:
        return network_of(said)
    except ValueError as error:
        raise SettingError("--trust-proxy", repr(said[:60]), NETWORK) from error


takes_access = takes(AccessOptions, "Who may come in")


@dataclass(frozen=True, slots=True)
class Exposure:
    """Checks that the owner of a reachable server has decided on access and encryption.

    Args:
        host: Host name or address that the server listens on.
        keys: Whether the server has keys for tokens.
        open: Whether the owner lets in anybody (--open).
        tls: Whether the server has a certificate.
        insecure: Whether the owner accepts a server without TLS (--insecure).
        behind_proxy: Whether a proxy forwards connections of strangers to the server.
    """

    host: str
    keys: bool = False
    open: bool = False
    tls: bool = False
    insecure: bool = False
    behind_proxy: bool = False

    @property
    def is_local(self) -> bool:
        """Whether only programs on this machine can connect to the server directly."""
        try:
            return ipaddress.ip_address(self.host.strip("[]")).is_loopback
        except ValueError:
            return self.host == "localhost"

    @property
    def admits_anybody(self) -> bool:
        """Whether people without a token may come in."""
        return self.open or not self.keys

    def check(self) -> None:
        """Raise SettingError, which names the options, if the owner still has to decide on some."""
        lacks: list[str] = []
        if not (self.keys or self.open) and (self.behind_proxy or not self.is_local):
            lacks.append("--keys FILE (made by: cohaptic key FILE) or --open for anybody")
        if not (self.tls or self.insecure) and not self.is_local:
            lacks.append("--tls-cert FILE --tls-key FILE or --insecure")
        if lacks:
            way = " through a proxy" if self.is_local else ""
            where = f"{self.host or 'every address'}, where other machines come in{way}"
            raise SettingError("host", where, f"given with {', and with '.join(lacks)}")
