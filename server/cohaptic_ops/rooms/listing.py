"""Lists the rooms of a server as JSON, and as a page on which people choose one. No I/O."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass

from cohaptic.errors import CloseCode, one_line
from cohaptic.room_address import MAIN, room_path, split_path
from cohaptic_server.http.routes import Answer, Request, page, text

LIST, CHOICE, HEALTH = "/rooms", "/rooms.html", "/healthz"
UNLISTED = "rooms are not listed here; open the link that you were invited with\n"


@dataclass(frozen=True, slots=True)
class RoomState:
    """State of a room, as the list of rooms shows it.

    Args:
        name: Name of the room.
        title: Title for people; if it is empty they see the name.
        state: State of the room: open, full, idle (starts when somebody comes), starting, broken or
            stopped.
        users, max_users: Number of users who touch, and their largest number at once.
        watchers, max_watchers: Number of watchers, and their largest number at once.
    """

    name: str
    title: str
    state: str
    users: int
    max_users: int
    watchers: int
    max_watchers: int


def room_of(target: str, rooms: Sequence[str]) -> str | None:
    """Return the name of the room that a request is for; None if the server itself answers it.

    Args:
        target: Path and query of the request.
        rooms: Names of all rooms.
    """
    name, path = split_path(target)
    if name is not None:
        return name if name in rooms else None
    if path in (LIST, CHOICE, HEALTH):
        return None
    if len(rooms) == 1:
        return rooms[0]
    return MAIN if MAIN in rooms else None


def answer(
    request: Request, rooms: Sequence[RoomState], *, listed: bool = True, base: str = ""
) -> Answer:
    """Return the response to a request for no room, or for a room that accepts nobody now.

    Args:
        request: Method, target and accepted encodings of the request.
        rooms: States of all rooms.
        listed: Whether anybody may know which rooms there are.
        base: Path below which a proxy offers the server.
    """
    if request.method not in ("GET", "HEAD"):
        message = f"{request.method[:16]} is not served here; GET and HEAD are\n"
        return text(request, 405, "Method Not Allowed", message, ("Allow", "GET, HEAD"))
    name, path = split_path(request.target)
    if name is not None:
        return _of_room(request, name, rooms)
    if path in (LIST, "/", CHOICE) and not listed:
        return text(request, 403, "Forbidden", UNLISTED)
    if path == LIST:
        return page(request, "application/json", as_json(rooms, base))
    if path in ("/", CHOICE):
        return page(request, "text/html; charset=utf-8", as_page(rooms), POLICY)
    if path == HEALTH:
        return _health(request, rooms if listed else ())
    return text(request, 404, "Not Found", "there is nothing of this name here\n")


def turned_away(
    target: str, rooms: Sequence[RoomState], *, listed: bool = True
) -> tuple[CloseCode, str]:
    """Return the close code and the reason for a websocket that no room accepts.

    Args:
        target: Path and query of the request.
        rooms: States of all rooms.
        listed: Whether anybody may know which rooms there are.
    """
    name, room = split_path(target)[0], room_of(target, [room.name for room in rooms])
    if room is not None:
        why = why_not(room, rooms)
        # If rooms are not listed, a client that names no room must not learn the name of the room
        # that its address leads to.
        return CloseCode.SERVER_STOPS, why if listed or name else "try again in a moment"
    asked = "this address has no room" if name is None else f"there is no room {one_line(name)}"
    others = f"; there are: {', '.join(room.name for room in rooms)}" if listed else ""
    return CloseCode.NO_ROOM, one_line(f"{asked} here{others}", 1000)


def why_not(name: str, rooms: Sequence[RoomState]) -> str:
    """Return the reason why a room accepts nobody now; empty if there is no room of this name."""
    states = {room.name: room.state for room in rooms}
    if name not in states:
        return ""
    if states[name] in ("open", "full", "idle"):
        return f"the room {name} takes nobody at present; try again"
    return f"the room {name} is {states[name]}; try again in a moment"


def _of_room(request: Request, name: str, rooms: Sequence[RoomState]) -> Answer:
    why = why_not(name, rooms)
    if why:
        retry = ("Retry-After", "1")
        return text(request, 503, "Service Unavailable", f"{why}\n", retry)
    return text(request, 404, "Not Found", f"there is no such room; see {LIST}\n")


def _health(request: Request, rooms: Sequence[RoomState]) -> Answer:
    # The status is always "OK", since it is the health of this process: an orchestrator would
    # otherwise restart all rooms because of a broken one.
    well = ("open", "full", "idle")
    bad = [f"{room.name}: {room.state}\n" for room in rooms if room.state not in well]
    return text(request, 200, "OK", "ok\n" + "".join(bad))


def as_json(rooms: Sequence[RoomState], base: str = "") -> bytes:
    """Return the list of rooms as JSON, with paths below `base`."""
    reported = [
        {
            "name": room.name,
            "title": room.title,
            "path": base + room_path(room.name),
            "state": room.state,
            "users": room.users,
            "max_users": room.max_users,
            "watchers": room.watchers,
            "max_watchers": room.max_watchers,
        }
        for room in rooms
    ]
    return json.dumps({"rooms": reported}, indent=1).encode() + b"\n"


# Colours and type as on the page (web/src/styles/base.css).
_STYLE = (
    ":root{color-scheme:light dark;--ground:#f3f4f2;--panel:#fbfbfa;--ink:#15191d;--ink-2:#59626b;"
    "--line:#dee1de;--accent:#0b6cb0;--shadow:0 1px 2px #141e2814}"
    "@media(prefers-color-scheme:dark){:root{--ground:#0d1013;--panel:#13171b;--ink:#e8ebed;"
    "--ink-2:#9ca6af;--line:#252c32;--accent:#5ab4f0;--shadow:none}}"
    "body{max-width:620px;margin:0 auto;padding:14px 20px 40px;background:var(--ground);"
    "color:var(--ink);font:400 14px/1.45 system-ui,Inter,'Segoe UI','Helvetica Neue',Arial,"
    "'DejaVu Sans',sans-serif;font-variant-numeric:tabular-nums}"
    "header{font-size:16px;font-weight:650;letter-spacing:-.015em}"
    "h1{margin:34px 0 4px;font-size:22px;font-weight:600;letter-spacing:-.02em}"
    "p,small{color:var(--ink-2)}p{margin:0 0 18px}small{display:block;font-size:13px}"
    "ul{display:grid;gap:10px;margin:0;padding:0;list-style:none}"
    "a{display:block;padding:12px 16px;border:1px solid var(--line);border-radius:10px;"
    "background:var(--panel);box-shadow:var(--shadow);color:inherit;text-decoration:none;"
    "overflow-wrap:anywhere}strong{font-size:15px;font-weight:600}"
    "a:hover,a:focus-visible{border-color:var(--accent)}a:hover strong{color:var(--accent)}"
    "a:focus-visible{outline:2px solid var(--accent);outline-offset:2px}"
)
_HASH = base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()
# The page loads nothing and runs no script; its one style is allowed by its hash.
POLICY = (
    f"default-src 'none'; style-src 'sha256-{_HASH}'; img-src data:; base-uri 'none';"
    " form-action 'none'; frame-ancestors 'none'"
)


def as_page(rooms: Sequence[RoomState]) -> bytes:
    """Return the HTML of the page on which people choose a room."""
    items = "".join(_item(room) for room in rooms)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="icon" href="data:,">'
        f"<title>Rooms - cohaptic</title><style>{_STYLE}</style></head>"
        "<body><header>cohaptic</header><h1>Rooms</h1><p>Each has an object that all its people"
        f" touch at once.</p><ul>{items}</ul></body></html>\n"
    ).encode()


def _item(room: RoomState) -> str:
    title = html.escape(room.title or room.name)
    said = {
        "open": f"{room.users} of {room.max_users} touch it, {room.watchers} watch",
        "full": f"full: {room.users} touch it. You can watch",
        "idle": "nobody is there; it starts when you come",
    }.get(room.state, room.state)
    # Relative, so that the page may stand behind a path of a proxy.
    words = f"<strong>{title}</strong><small>{html.escape(said)}</small>"
    return f'<li><a href=".{room_path(room.name)}/">{words}</a></li>'
