"""Check of a websocket's origin: no page from elsewhere may use a visitor's browser.

A browser names the origin of the page (Origin) and the host that it connects to (Host). If both are
the same, the page is the server's own. That does not hold for a server that listens on the loopback
address alone: a foreign name that resolves to it would pass as well (DNS rebinding).
"""

from __future__ import annotations

import re
from collections.abc import Collection

LOOPBACK = ("127.0.0.1", "::1", "localhost")
_THIS_MACHINE = re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?")


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
