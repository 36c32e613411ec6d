"""Show the state of hands as text: a live table for a terminal, or lines for a log or a pipe.

The table has one row per user, in millimetres and milliseconds. A summary describes one visit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rich import box
from rich.cells import cell_len
from rich.console import Group
from rich.table import Table
from rich.text import Text

from cohaptic.status.report import TouchStatus

_BAR = 10  # characters of a full force bar
_FULL = 6.0  # N that fill the bar; a firm press of a finger
_NAME = 12  # characters of a name
LEAST_WAVERS = 0.01  # s; scheduling alone makes a few milliseconds
LEAST_LAG = 0.005  # s; with two decimals a shorter lag would be shown as zero


class _Column(NamedTuple):
    """A column of the table of users.

    Fields:
        head: Heading of the column.
        rank: Order of removal: a narrow table loses the column with the highest rank first.
        least: Smallest width [characters], so that columns stay in place while numbers change.
        cells: One cell for each user.
    """

    head: str
    rank: int
    least: int
    cells: list[Text]

    @property
    def wide(self) -> int:
        """Width of the column [characters]."""
        return max(self.least, cell_len(self.head), *(cell.cell_len for cell in self.cells))


def status_view(users: Sequence[TouchStatus], *, width: int = 120) -> Group:
    """Return the table of `status_table`, and below it the sentences of `status_notes`."""
    notes = [Text(note, style="yellow") for note in status_notes(users)]
    return Group(status_table(users, width=width), *notes)


def status_notes(users: Sequence[TouchStatus]) -> list[str]:
    """Return sentences on soft devices, cut forces, faults and the room's lag.

    Args:
        users: All users who touch the object.
    """
    notes = [
        f"{user.name}: device renders {soft_words(user.max_stiffness, user.k_o)}"
        for user in users
        if user.soft
    ]
    notes += [
        f"{user.name}: gives {user.max_force:.1f} of {user.wanted:.1f} N"
        for user in users
        if user.cut
    ]
    notes += [f"{user.name}: force off: {user.fault}" for user in users if user.fault]
    notes += [
        f"{user.name}: {wavers_words(user.wavers)}" for user in users if user.wavers >= LEAST_WAVERS
    ]
    lag = max((user.lag for user in users), default=0.0)
    return notes + ([lag_words(lag)] if lag >= LEAST_LAG else [])


def soft_words(renders: float, k_o: float) -> str:
    """Return a device's stiffness and the object's `k_o` [N/m] in words: "300 of 500 N/m"."""
    return f"{renders:,.0f} of {k_o:,.0f} N/m"


def wavers_words(wavers: float) -> str:
    """Return in words what playing at constant time costs on a link that wavers [s]."""
    return f"the link wavers: others are felt {1e3 * wavers:.0f} ms later"


def lag_words(lag: float) -> str:
    """Return the room's lag [s] in words for a user."""
    return f"the object answers the others in {lag:.2f} s"


def status_table(users: Sequence[TouchStatus], *, width: int = 120) -> Table:
    """Return a table of the users' present forces, with as many columns as the width allows.

    Args:
        users: Users, one for each row.
        width: Width of the terminal [characters].
    """
    columns = _columns(users)
    while len(columns) > 1 and _wide(columns) > width:
        columns.remove(max(columns, key=lambda column: column.rank))
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    for column in columns:
        left = column.head in ("user", "")
        table.add_column(
            column.head,
            justify="left" if left else "right",
            no_wrap=True,
            min_width=column.wide,
        )
    for row in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*row)
    return table


def _columns(users: Sequence[TouchStatus]) -> list[_Column]:

    def column(head: str, rank: int, least: int, cells: Sequence[str]) -> _Column:
        return _Column(head, rank, least, [Text(cell) for cell in cells])

    states = [Text(user.state, style=_STYLE.get(user.state, "")) for user in users]
    along = [] if all(user.along is None for user in users) else [
        column("along", 4, 6, [_along(user.along) for user in users])
    ]  # fmt: skip
    trips = [_spread("", user.round_trip, user.jitter) for user in users]
    clocks = [_spread("+", user.clock_offset, user.clock_error) for user in users]
    return [
        column("user", 0, 4, [_short(user.name) for user in users]),
        _Column("", 1, 13, states),
        column("", 7, _BAR, [bar(user.force) for user in users]),
        column("force", 2, 8, [f"{user.force:.2f} N" for user in users]),
        column("of others", 3, 9, [f"{user.felt_from_others:+5.2f} N" for user in users]),
        *along,
        column("depth", 5, 7, [f"{1e3 * user.indentation:.1f} mm" for user in users]),
        column("K_o", 6, 9, [_stiffness(user) for user in users]),
        column("round trip", 8, 11, trips),
        column("clock", 11, 12, clocks),
        column("loop", 9, 7, [f"{user.loop_hz:.0f} Hz" for user in users]),
        column("late p99", 10, 8, [f"{1e6 * user.loop_late_p99:.0f} us" for user in users]),
    ]


def _wide(columns: Sequence[_Column]) -> int:
    """Return the width of a table with these columns [characters]."""
    # Between two columns are two spaces and a line of the box; its two edges come on top.
    return sum(column.wide for column in columns) + 3 * (len(columns) - 1) + 2


def _short(name: str) -> str:
    return name if len(name) <= _NAME else name[: _NAME - 1] + "…"


def _along(force: float | None) -> str:
    return "" if force is None else f"{force:.2f} N"


def _stiffness(user: TouchStatus) -> str:
    return soft_words(user.max_stiffness, user.k_o) if user.soft else f"{user.k_o:,.0f} N/m"


def _spread(sign: str, middle: float, spread: float) -> str:
    return f"{1e3 * middle:{sign}.0f} ±{1e3 * spread:.0f} ms"


def bar(force: float) -> str:
    """Return a bar of fixed width, filled in proportion to a force [N]."""
    filled = min(_BAR, round(_BAR * force / _FULL))
    return "█" * filled + "·" * (_BAR - filled)


_STYLE = {
    "touching": "bold green",
    "free": "cyan",
    "waiting": "yellow",
    "connecting": "yellow",
    "device silent": "bold red",
    "server silent": "bold red",
    "fault": "bold white on red",
}


EVERY = 1.0  # s between two lines if the output is not a terminal


def status_line(user: TouchStatus) -> str:
    """Return one line on the present state of a hand."""
    parts = [user.state]
    if user.state == "touching":
        parts += [f"{user.force:.2f} N", f"{user.felt_from_others:+.2f} N of others"]
        parts += [f"{1e3 * user.indentation:.1f} mm deep", f"K_o {user.k_o:.0f} N/m"]
    parts += [f"force off: {user.fault}"] if user.fault else []
    return f"{user.name}: {', '.join(parts)}"


class Summary:
    """Summary of a visit, computed from status reports and printed at the end.

    Args:
        began: Time at which the visit began [s].
    """

    def __init__(self, began: float) -> None:
        self._began = began
        self._before: float | None = None  # time of the previous report, if the hand touched then
        self._touched = 0.0
        self._highest = 0.0
        self._last: TouchStatus | None = None

    def read(self, user: TouchStatus, now: float) -> None:
        """Add the status report of time `now` [s]."""
        touches = user.state == "touching"
        if touches and self._before is not None:
            self._touched += min(
                now - self._before, EVERY
            )  # time in which the process was stopped does not count as touching
        self._before = now if touches else None
        self._highest = max(self._highest, user.force)
        if user.loop_hz > 0.0 and user.round_trip > 0.0:
            self._last = user

    def line(self, now: float) -> str:
        """Return the summary at time `now` [s]; empty if loop and network were never measured."""
        user = self._last
        if user is None:
            return ""
        return (
            f"{user.name}: touched for {self._touched:.0f} of {now - self._began:.0f} s, at most"
            f" {self._highest:.2f} N shown; round trip {1e3 * user.round_trip:.0f} ms; loop"
            f" {user.loop_hz:.0f} Hz, {user.loop_missed} periods left out"
        )
