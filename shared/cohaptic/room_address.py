"""Rooms in addresses: `ws://HOST:PORT/r/NAME`, and the page of the room at `/r/NAME/`."""

from __future__ import annotations

import re
from urllib.parse import urlsplit, urlunsplit

from cohaptic.errors import SettingError

MAIN = "main"  # the room at `/`, where there is one of this name
# Lower case, since names are typed and are part of names of environment variables, whose parts two
# underscores divide.
_NAME = re.compile(r"(?!.*__)[a-z0-9](?:[a-z0-9_-]{0,62}[a-z0-9])?")
_PATH = re.compile(r"/r/([^/?#]*)([^?#]*)")
# Of letters that every proxy leaves as they are. `r` divides it from the room for whoever reads an
# address from its end, and dots are folders that a browser resolves.
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
    """Whether a room may be called so."""
    return _NAME.fullmatch(name) is not None


def room_path(name: str) -> str:
    """Path of a room, without a slash at its end."""
    return f"/r/{name}"


def base_path(said: str) -> str:
    """Path that a server is below, without a slash at its end; empty for the root.

    Raises:
        SettingError: It can be none.
    """
    path = said.rstrip("/")
    if path and (len(path) > _LONGEST_BASE or not _BASE.fullmatch(path)):
        raise SettingError("--base-path", repr(said[:60]), BASES)
    return path


def below(target: str, base: str) -> str:
    """Path and query of a request, without the path that the server is below.

    What is not below it is left as it is: a proxy may take it off itself, and who comes without a
    proxy has none. Of the path itself, without a slash at its end, nothing is left but a query.

    Args:
        target: Path and query.
        base: As `base_path` gives it.
    """
    rest = target.removeprefix(base)
    return rest if rest[:1] in ("", "/", "?") else target


def split_path(target: str) -> tuple[str | None, str]:
    """The room that a path of a request names, and the path within it.

    Args:
        target: Path, with or without a query.

    Returns:
        Name as it was given, None for a path outside of `/r/`; and the rest: empty for `/r/NAME`,
        else from its slash on.
    """
    path = target.partition("?")[0].partition("#")[0]
    match = _PATH.fullmatch(path)
    return (match[1], match[2]) if match is not None else (None, path)


def room_in(url: str) -> str | None:
    """The room that an address names, as it is given; None for one that names none.

    Args:
        url: URL of a server or of a page, also behind a path of a proxy.
    """
    _, given, name = urlsplit(url).path.rpartition("/r/")
    return name.strip("/") if given else None


def room_url(url: str, room: str) -> str:
    """Address of a room of a server.

    Args:
        url: URL of the server, or already of this room.
        room: Its name; empty leaves the address as it is.

    Raises:
        SettingError: No room can be called so, or the address is that of another room.
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
