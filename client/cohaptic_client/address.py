"""Reads a server's address or the link of an invitation, and sets up TLS for the connection."""

from __future__ import annotations

import ipaddress
import ssl
from dataclasses import dataclass, field
from urllib.parse import parse_qs, urlsplit, urlunsplit

from cohaptic.errors import SettingError
from cohaptic.room_address import room_url

_SCHEMES = {"http": "ws", "https": "wss", "ws": "ws", "wss": "wss"}


@dataclass(frozen=True, slots=True)
class Address:
    """URL of a server, with the token of an invitation if the link contained one.

    Args:
        url: URL with ws: or wss:; the user's text, unchanged, if that text was no address.
        token: Token from the link; empty for none.
    """

    url: str
    token: str = field(default="", repr=False)


def read_address(said: str) -> Address:
    """Read the address that a user typed; a text that is no address stays unchanged as the URL.

    Args:
        said: Text of the user: `ws://HOST:PORT`, or a link such as
            `https://lab.example/#token=...`.
    """
    try:
        parts = urlsplit(said)
    except ValueError:
        return Address(said)
    scheme = _SCHEMES.get(parts.scheme)
    if scheme is None:
        return Address(said)
    token = parse_qs(parts.fragment).get("token", [""])[0]
    # Without query and fragment, because both could be written to a log.
    return Address(urlunsplit((scheme, parts.netloc, parts.path, "", "")), token)


def room_at(said: str, token: str, room: str = "", *, insecure: bool = False) -> Address:
    """Return the address of a room, with the token to send there.

    Args:
        said: As for `read_address`.
        token: Token, if the link has none; empty for none.
        room: Name of a room of a server with several; empty for that of the address.
        insecure: Whether to send a token without TLS.

    Raises:
        SettingError: The token would go to another machine without encryption, or `room` is no
            name of a room.
    """
    address = read_address(said)
    token = address.token or token
    if token:
        check_secrecy(address.url, insecure=insecure)
    return Address(room_url(address.url, room), token)


def with_slash(url: str) -> str:
    """Return `url` with a slash at the end of its path, for opening a websocket.

    A proxy that serves paths below /haptics/ redirects a request for /haptics to its https: page,
    where a websocket cannot follow. A server accepts both forms.
    """
    try:
        parts = urlsplit(url)
    except ValueError:
        return url
    if not parts.netloc or parts.path.endswith("/"):
        return url
    return urlunsplit(parts._replace(path=f"{parts.path}/"))


def check_secrecy(url: str, *, insecure: bool) -> None:
    """Raise SettingError if a token would go to another machine without encryption."""
    parts = urlsplit(url)
    if parts.scheme == "wss" or insecure or _is_here(parts.hostname or ""):
        return
    limit = "wss://, or given with --insecure: who is on the way reads the token"
    raise SettingError("address that a token goes to", f"{parts.scheme}://", limit)


def _is_here(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def proxy_for(url: str) -> str | None:
    """Return the URL of the HTTP proxy to reach an address through; None to reach it directly.

    Only a connection with TLS to a public host goes through the proxy of the environment or the
    system (HTTPS_PROXY). A proxy cannot look into it, so that it passes bytes on at once; one for
    plain HTTP may hold messages back. NO_PROXY lists exceptions. A private address, or a name
    without a dot or below `.local`, is in the same network.

    Args:
        url: URL of a server.
    """
    parts = urlsplit(url)
    if parts.scheme != "wss" or _is_near(parts.hostname or ""):
        return None
    # Imported here: it takes 30 ms, and most connections are to this machine or this network.
    from urllib.request import getproxies, proxy_bypass

    proxy = getproxies().get("https", "")
    if not proxy.startswith(("http://", "https://")) or proxy_bypass(parts.netloc):
        return None
    return proxy


def _is_near(host: str) -> bool:
    try:
        return not ipaddress.ip_address(host).is_global
    except ValueError:
        return "." not in host or host.endswith((".local", ".localhost"))


def silence(proxy: str | None) -> str:
    """Describe in a sentence that nothing answers, with advice to the user.

    Args:
        proxy: URL of the proxy in between; None without one.
    """
    if proxy is None:
        return "no server answers; start one with: cohaptic serve"
    host = urlsplit(proxy).netloc.rpartition("@")[2]  # without a password
    return (
        f"no server answers through the proxy {host}, which HTTPS_PROXY or the system names;"
        " NO_PROXY lists hosts to be reached without it"
    )


def trust(url: str, ca_file: str = "") -> ssl.SSLContext | None:
    """Return the TLS context for a connection to `url`; None for an address without TLS.

    Args:
        ca_file: File with the certificates to trust; empty for the system's certificates.

    Raises:
        SettingError: The file cannot be read, or has no certificates.
    """
    if not url.startswith("wss:"):
        return None
    try:
        return ssl.create_default_context(cafile=ca_file or None)
    except (OSError, ValueError) as error:
        raise SettingError(
            "--ca-file", ca_file, f"a file of certificates (PEM): {error}"
        ) from error


def why_not_trusted(error: ssl.SSLError, host: str) -> str:
    """Describe a failed TLS connection to `host` in one sentence, with advice to the user."""
    if isinstance(error, ssl.SSLCertVerificationError):
        why = error.verify_message or "it cannot be verified"
        if error.verify_code == 10:
            return "the certificate of the server has expired; its owner has to renew it"
        if error.verify_code in (62, 64):
            return f"the certificate of the server is not for {host}: {why}"
        return f"the certificate of the server is not trusted: {why}; name its issuer: --ca-file"
    reason = getattr(error, "reason", None)
    if reason in ("WRONG_VERSION_NUMBER", "HTTP_REQUEST", "RECORD_LAYER_FAILURE"):
        return "the server speaks no TLS on this port; try ws:// in place of wss://"
    return f"no secure connection to the server: {reason or error}"
