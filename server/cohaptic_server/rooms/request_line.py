"""The path of an HTTP request, read from the first bytes of a connection that nobody takes yet."""

from __future__ import annotations

import re

MOST = 2048  # bytes of a request's first line; what is longer is no room's
_LINE = re.compile(rb"[A-Z]{1,16} ([\x21-\x7e]+) HTTP/1\.[01]\r?")
_BEGINS = re.compile(rb"[A-Z]{1,16}(?: [\x21-\x7e]*(?: [HTP/1.0]{0,8}\r?)?)?")


def target_of(seen: bytes) -> str | None:
    """Path and query that a request asks for.

    Args:
        seen: First bytes of the connection.

    Returns:
        Empty if it is no request whose path can be found, which nothing that follows would mend;
        None while the line is not complete.
    """
    line, end, _ = seen[:MOST].partition(b"\n")
    if end:
        match = _LINE.fullmatch(line)
        return match[1].decode("ascii") if match is not None else ""
    if len(seen) >= MOST or (seen and _BEGINS.fullmatch(seen) is None):
        return ""
    return None
