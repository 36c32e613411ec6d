"""Draws the state of a server as tables for a terminal. No I/O."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from pydantic import BaseModel, ConfigDict
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cohaptic.errors import one_line
from cohaptic.status.quantiles import TIME_EDGES
from cohaptic.status.table import LEAST_LAG, LEAST_WAVERS
from cohaptic_ops.monitoring.metrics import ClusterHealth, RoomMetrics, TimeCounts, UserMetrics

_LONGEST_NAME = 18  # columns; of 80 columns, the other cells of a row need the rest
_WIDE = 100  # columns from which on there is space for less important values
_GOOD, _ODD, _BAD = "green", "yellow", "red"
NONE = "-"
_MAX_NAMES = 3  # in a sentence
_HINDERS = {
    "hand": "by a law or a device that has none",
    "link": "over a link whose delay jumps again and again",
}
# Delay [s] above which a user feels that the object lags; fraction of unused samples above which
# the user loses contact with the object.
_LONG_DELAY, _MUCH_LOSS = 0.3, 0.5


class RoomStatus(BaseModel):
    """State of one room in the response to `/status`; a newer server may add fields (ignored)."""

    model_config = ConfigDict(frozen=True)

    name: str
    state: str
    problem: str
    restarts: int
    ticking: bool
    age: float | None
    metrics: RoomMetrics | None


class Status(BaseModel):
    """The response to `/status`: the state of the server and of its rooms."""

    model_config = ConfigDict(frozen=True)

    version: str
    alive: bool
    ready: bool
    draining: bool
    reasons: tuple[str, ...]
    connections: int
    refused: int
    cluster: ClusterHealth | None = None
    rooms: tuple[RoomStatus, ...]


def overview(status: Status, before: Status | None, width: int) -> RenderableType:
    """Return a drawing with a headline, and tables of rooms and users.

    Args:
        status: Newest status.
        before: Earlier status from which on ticks are counted; None counts from the start.
        width: Width of the terminal [columns].
    """
    earlier = {} if before is None else {room.name: room.metrics for room in before.rooms}
    since = {room.name: since_then(room.metrics, earlier.get(room.name)) for room in status.rooms}
    parts: list[RenderableType] = [_headline(status)]
    if status.cluster is not None:
        style = "" if status.cluster.answering == status.cluster.witnesses else _ODD
        parts.append(Text(cluster_words(status.cluster), style if status.cluster.holds else _BAD))
    parts += [_rooms(status.rooms, since, width)]
    parts += [
        Text(f"{room.name}: {one_line(room.problem, 200)}", _BAD)
        for room in status.rooms
        if room.problem
    ]
    if any(room.metrics is not None and room.metrics.users for room in status.rooms):
        parts.append(_users(status.rooms, width))
    # Below the tables, which they would move while hands come and go.
    for room in status.rooms:
        parts += [
            Text(words, _ODD)
            for words in (lag_words(room), models_words(room), wavers_words(room))
            if words
        ]
    return Group(*parts)


def cluster_words(cluster: ClusterHealth) -> str:
    """Return a sentence on a machine in its cluster."""
    words = [
        f"{cluster.answering} of {cluster.witnesses} witnesses answer",
        f"{cluster.owned} rooms here",
        f"{cluster.passed} connections passed on",
    ]
    if cluster.decides:
        words.append("decides where rooms are wanted")
    elif cluster.engine is False:
        words.append("the engine is not reached")
    return f"{cluster.machine}: {', '.join(words)}"


def lag_words(room: RoomStatus) -> str:
    """Return a sentence on the users whose damping or delay sets a room's lag; empty if none do."""
    metrics = room.metrics
    if metrics is None or not room.ticking or metrics.lag < LEAST_LAG:
        return ""
    users = [user for user in metrics.users if user.sets_lag is not None]
    if not users:
        return ""
    reported, many = _names(users), len(users) > 1
    if users[0].sets_lag == "delay":
        why = f"loops of {reported} are slowest" if many else f"loop of {reported} is slowest"
    else:
        why = f"device{'s' if many else ''} of {reported} may damp least"
    return f"{_name(room.name)}: lag of {1e3 * metrics.lag:.0f} ms, since the {why}"


def models_words(room: RoomStatus) -> str:
    """Return a sentence on why a room's clients do without models of the hands; empty if not so."""
    metrics = room.metrics
    if metrics is None or not room.ticking or not metrics.models_off:
        return ""
    users = [user for user in metrics.users if user.forbids_models]
    if metrics.models_off == "object":
        why = "the object or a contact on it was no linear spring"
    elif metrics.models_off == "number":
        why = "more than 8 hands pressed"
    else:
        who = _names(users) if users else "a user who has left"
        why = f"{who} pressed {_HINDERS[metrics.models_off]}"
    fraction = f"{100.0 * (metrics.models or 0.0):.0f} %"
    return f"{_name(room.name)}: models of the hands answer to {fraction}, since {why}"


def wavers_words(room: RoomStatus) -> str:
    """Return a sentence on the users whose links waver, and what that costs; empty without any."""
    metrics = room.metrics
    users = [] if metrics is None else [u for u in metrics.users if u.wavers >= LEAST_WAVERS]
    if not room.ticking or not users:
        return ""
    largest = 1e3 * max(user.wavers for user in users)
    reported, many = _names(users), len(users) > 1
    links = f"links of {reported} waver" if many else f"link of {reported} wavers"
    return f"{_name(room.name)}: the {links}; what comes of it is felt up to {largest:.0f} ms later"


def _names(users: Sequence[UserMetrics]) -> str:
    names = [_name(user.name) for user in users[:_MAX_NAMES]]
    if len(users) > _MAX_NAMES:
        names.append(f"{len(users) - _MAX_NAMES} more")
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def since_then(now: RoomMetrics | None, before: RoomMetrics | None) -> RoomMetrics | None:
    """Return the newest metrics, with ticks and times counted from an earlier report on."""
    if now is None or before is None or before.ticks >= now.ticks:
        return now
    changes = {
        "ticks": now.ticks - before.ticks,
        "missed": now.missed - before.missed,
        "cost": _less(now.cost, before.cost),
        "lateness": _less(now.lateness, before.lateness),
    }
    return now.model_copy(update=changes)


def quantile(times: TimeCounts, q: float) -> float | None:
    """Return a quantile of a histogram of times [s]; None if the histogram is empty.

    The quantile is interpolated linearly within its bucket.

    Args:
        times: Histogram.
        q: Fraction of the times that lie below the quantile, 0 to 1.
    """
    wanted, below = q * sum(times.counts), 0.0
    if not wanted:
        return None
    for (lower, upper), count in zip(pairwise((0.0, *TIME_EDGES)), times.counts, strict=False):
        if count and below + count >= wanted:
            return lower + (upper - lower) * (wanted - below) / count
        below += count
    return TIME_EDGES[-1]


def _less(now: TimeCounts, before: TimeCounts) -> TimeCounts:
    counts = [max(0, a - b) for a, b in zip(now.counts, before.counts, strict=True)]
    return TimeCounts(counts=counts, total=max(0.0, now.total - before.total))


def _headline(status: Status) -> Text:
    users = sum(len(room.metrics.users) for room in status.rooms if room.metrics is not None)
    ticking = sum(room.ticking for room in status.rooms)
    line = Text(f"cohaptic {one_line(status.version, 20)}  ", "bold")
    if status.ready:
        line.append("ready", _GOOD)
    else:
        why = one_line("; ".join(status.reasons), 120)
        line.append(f"not ready: {why}", _BAD)
    rooms = f"{ticking} of {len(status.rooms)} rooms tick"
    line.append(f"  {rooms}, {users} touch, {status.connections} connections", "not bold")
    return line


def _rooms(rooms: Sequence[RoomStatus], since: dict[str, RoomMetrics | None], width: int) -> Table:
    wide = width >= _WIDE
    heads = ["users", "tick ms", "p99", "late", "missed", "lag ms", "margin"]
    more = ["watch", "MB", "limited"] if wide else []
    table = _table("room", ["state"], [*heads, *more])
    for room in rooms:
        state = room.state if room.ticking or room.state != "open" else "no tick"
        cells = [
            Text(_name(room.name)),
            Text(state, _GOOD if room.ticking else "" if state == "idle" else _BAD),
        ]
        now = since[room.name]
        if now is None or not room.ticking:
            table.add_row(*cells)
            continue
        fraction = now.missed / max(1, now.ticks)
        cells += [
            Text(f"{len(now.users)}/{now.max_users}"),
            _ms(quantile(now.cost, 0.5), 1.0 / now.hz),
            _ms(quantile(now.cost, 0.99), 1.0 / now.hz),
            _ms(quantile(now.lateness, 0.99), 1.0 / now.hz),
            Text(
                f"{100.0 * fraction:.1f} %",
                _BAD if fraction >= 0.1 else _ODD if fraction > 0.01 else "",
            ),
            Text(f"{1e3 * now.lag:.0f}"),
            _margin(now.margin),
        ]
        if wide:
            limited = sum(now.limited.values())
            memory = f"{now.memory / 2**20:.0f}"
            cells += [Text(str(now.watchers)), Text(memory), Text(str(limited))]
        table.add_row(*cells)
    return table


def _users(rooms: Sequence[RoomStatus], width: int) -> Table:
    wide = width >= _WIDE
    heads = ["delay ms", "unused", "force N", "silent s"]
    table = _table("user", ["room"], ["seat", *heads, *(["skipped"] if wide else [])])
    for room in rooms:
        for user in () if room.metrics is None or not room.ticking else room.metrics.users:
            long = user.delay is not None and user.delay > _LONG_DELAY
            delay = NONE if user.delay is None else f"{1e3 * user.delay:.0f}"
            cells = [
                Text(_name(user.name)),
                Text(_name(room.name)),
                Text(str(user.seat)),
                Text(delay, _ODD if long else ""),
                Text(f"{100.0 * user.loss:.0f} %", _ODD if user.loss > _MUCH_LOSS else ""),
                Text(f"{user.force:.2f}"),
                Text(f"{user.silence:.1f}", _ODD if user.silence > 0.5 else ""),
            ]
            table.add_row(*cells, *([Text(str(user.skipped))] if wide else []))
    return table


def _table(first: str, left: Sequence[str], right: Sequence[str]) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold", show_edge=False)
    for name in (first, *left):
        table.add_column(name, no_wrap=True, overflow="ellipsis")
    for name in right:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _name(text: str) -> str:
    line = one_line(text, 200)
    return line if len(line) <= _LONGEST_NAME else line[: _LONGEST_NAME - 1] + "…"


def _ms(time: float | None, period: float) -> Text:
    if time is None:
        return Text(NONE)
    style = _BAD if time > period else _ODD if time > 0.5 * period else ""
    return Text(f"{1e3 * time:.1f}", style)


def _margin(margin: float | None) -> Text:
    if margin is None:
        return Text("∞")
    return Text(f"{margin:.2f}" if margin < 100.0 else ">99", _BAD if margin < 1.0 else "")
