"""The live view of a terminal: one row per user, in millimetres and milliseconds."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from cohaptic.report import TouchStatus

_BAR = 10  # characters of a full force bar
_FULL = 6.0  # N that fill it
_WIDE = 130  # characters that all columns take


def status_table(users: Sequence[TouchStatus], *, width: int = 120) -> Table:
    """A table of what each user feels now, with fewer columns in a narrow terminal.

    Args:
        users: One row each.
        width: Of the terminal [characters].
    """
    narrow = width < _WIDE
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    table.add_column("user", no_wrap=True, max_width=12)
    table.add_column("", no_wrap=True)
    names = ["force", "of others", "indentation", "K_o", "round trip", "clock", "loop", "late p99"]
    for name in names[:2] + names[4:5] + names[6:7] if narrow else names:
        table.add_column(name, justify="right", no_wrap=True)
    for user in users:
        cells: list[Text | str] = [
            Text(f"{bar(user.force)} {user.force:5.2f} N"),
            f"{user.felt_from_others:+5.2f} N",
            f"{1e3 * user.indentation:.1f} mm",
            f"{user.k_o:.0f} N/m",
            f"{1e3 * user.round_trip:.0f} ±{1e3 * user.jitter:.0f} ms",
            f"{1e3 * user.clock_offset:+.0f} ±{1e3 * user.clock_error:.0f} ms",
            f"{user.loop_hz:.0f} Hz",
            f"{1e6 * user.loop_late_p99:.0f} us",
        ]
        state = Text(user.state, style=_STYLE.get(user.state, ""))
        table.add_row(
            Text(user.name), state, *(cells[:2] + cells[4:5] + cells[6:7] if narrow else cells)
        )
    return table


def bar(force: float) -> str:
    """A force as a bar of fixed width."""
    filled = min(_BAR, round(_BAR * force / _FULL))
    return "█" * filled + "·" * (_BAR - filled)


_STYLE = {
    "touching": "bold green",
    "free": "cyan",
    "waiting": "yellow",
    "connecting": "yellow",
    "server silent": "bold red",
}
