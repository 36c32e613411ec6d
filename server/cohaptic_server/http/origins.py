"""Whose pages may open a websocket: a visitor's browser must not be used by a page from elsewhere.

A browser says where a page came from (Origin) and what name it went to (Host). The same name in
both is the server's own page, but not where the server listens on this machine alone: there a
stranger's name that was made to point here would pass too (DNS rebinding).
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
        origin: That the browser names; None from a native client, which has none.
        host: That the request names.
        listens_on: Address of the server.
        allowed: Further origins.
    """
    if origin is None or origin in allowed or _THIS_MACHINE.fullmatch(origin):
        return True
    if listens_on in LOOPBACK or host is None:
        return False
    return origin.lower() in (f"http://{host.lower()}", f"https://{host.lower()}")
