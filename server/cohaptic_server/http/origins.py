"""Check of a websocket's origin: no page from elsewhere may use a visitor's browser.

A browser names the origin of the page (Origin) and the host that it connects to (Host). If both are
the same, the page is the server's own. That does not hold for a server that listens on the loopback
address alone: a foreign name that resolves to it would pass as well (DNS rebinding).
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Collection

LOOPBACK = ("127.0.0.1", "::1", "localhost")
_THIS_MACHINE = re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?")
_OWN_HOST = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:\d+)?", re.IGNORECASE)


def may_connect(
    origin: str | None, host: str | None, *, listens_on: str, allowed: Collection[str]
) -> bool:
    """Whether a page may open a websocket.

    Args:
        origin: Header of the request; None from a native client.
        host: Header of the request; None without one.
        listens_on: Address of the server.
        allowed: Further origins.
    """
    if origin is None or origin in allowed or _THIS_MACHINE.fullmatch(origin):
        return True
    if listens_on in LOOPBACK or host is None:
        return False
    return origin.lower() in (f"http://{host.lower()}", f"https://{host.lower()}")


def may_upload(
    origin: str | None, host: str | None, peer: str | None, *, allowed: Collection[str]
) -> bool:
    """Whether a connection may bring a file, which is more than to touch.

    It must come from this machine, also through a tunnel, and from the server's own page or no page
    at all: another page of this machine, or of a name that was made to point at it, may not.

    Args:
        origin: Header of the request; None from a native client.
        host: Header of the request; None without one.
        peer: Address of the other end; None if it is not known.
        allowed: Further origins.
    """
    if peer is None or not _is_loopback(peer):
        return False
    if origin is not None and origin in allowed:
        return True
    if host is None or not _OWN_HOST.fullmatch(host):
        return False
    return origin is None or origin.lower() in (f"http://{host.lower()}", f"https://{host.lower()}")


def _is_loopback(peer: str) -> bool:
    try:
        address = ipaddress.ip_address(peer.partition("%")[0])
    except ValueError:
        return False
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return (mapped or address).is_loopback
