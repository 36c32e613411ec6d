"""Read and make addresses of rooms: `ws://HOST:PORT/r/NAME`, with the page at `/r/NAME/`."""

from __future__ import annotations

import re
from urllib.parse import urlsplit, urlunsplit

from cohaptic.errors import SettingError

MAIN = "main"  # the room at `/`, if the server has a room of this name
# Lower case, since people type names. No double underscore, since a room's name is part of the
# names of environment variables, in which two underscores separate the parts.
_NAME = re.compile(r"(?!.*__)[a-z0-9](?:[a-z0-9_-]{0,62}[a-z0-9])?")
_PATH = re.compile(r"/r/([^/?#]*)([^?#]*)")
# Only characters that every proxy leaves as they are. A part `r` is excluded because it divides the
# base path from the room when an address is read from its end. A leading dot is excluded because a
# browser resolves `.` and `..` as folders.
_BASE = re.compile(r"(?:/(?!r(?:/|$)|\.)[A-Za-z0-9._~-]+)+")
_LONGEST_BASE = 200
BASES = (
    "a path of letters, digits and '._~-', none of its parts 'r' or with a dot in front:"
    f" /haptics; at most {_LONGEST_BASE} characters"
)
NAMES = (
    "1 to 64 lower-case letters, digits, '-' and '_', with a letter or a digit at both ends"
    " and no two '_' together"
)


def is_room_name(name: str) -> bool:
    """Return whether a room may have this name."""
    return _NAME.fullmatch(name) is not None


def room_path(name: str) -> str:
    """Return the URL path of a room, without a slash at its end."""
    return f"/r/{name}"


def base_path(said: str) -> str:
    """Check a server's base path and return it without a slash at its end; empty for the root.

    Raises:
        SettingError: The path is not a valid base path.
    """
    path = said.rstrip("/")
    if path and (len(path) > _LONGEST_BASE or not _BASE.fullmatch(path)):
        raise SettingError("--base-path", repr(said[:60]), BASES)
    return path


def below(target: str, base: str) -> str:
    """Return the path and query of a request without the server's base path.

    A target outside the base path is returned unchanged: a proxy may remove the base path itself,
    and a client that connects without a proxy does not use it. If the target is the base path
    without a slash at its end, the function returns only the query.

    Args:
        target: Path and query.
        base: Base path as `base_path` returns it.
    """
    rest = target.removeprefix(base)
    return rest if rest[:1] in ("", "/", "?") else target


def split_path(target: str) -> tuple[str | None, str]:
    """Split the path of a request into the room that it names and the path within that room.

    Args:
        target: Path, with or without a query.

    Returns:
        Name of the room as the path spells it, and the rest of the path, which is empty for
        `/r/NAME` and otherwise begins with a slash. For a path outside `/r/`, None and that path.
    """
    path = target.partition("?")[0].partition("#")[0]
    match = _PATH.fullmatch(path)
    return (match[1], match[2]) if match is not None else (None, path)


def room_in(url: str) -> str | None:
    """Return the name of the room in an address; None if the address names no room.

    Args:
        url: URL of a server or of a page, also below a proxy's path.
    """
    _, given, name = urlsplit(url).path.rpartition("/r/")
    return name.strip("/") if given else None


def room_url(url: str, room: str) -> str:
    """Return the address of a room on a server.

    Args:
        url: URL of the server, or of the room itself.
        room: Name of the room; if empty, the address is returned as it is.

    Raises:
        SettingError: The name is invalid, or the address is that of another room.
    """
    if not room:
        return url
    if not is_room_name(room):
        raise SettingError("--room", repr(room), NAMES)
    parts = urlsplit(url)
    other = room_in(url)
    if other is not None:
        if other != room:
            raise SettingError("--room", room, f"{other}, as the address {url} says, or left out")
        return url
    path = parts.path.rstrip("/") + room_path(room)
    return urlunsplit((parts.scheme, parts.netloc, path, "", ""))
