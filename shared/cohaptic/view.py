"""The live view of a terminal: one row per user, in millimetres and milliseconds."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from cohaptic.report import TouchStatus

_BAR = 12  # characters of a full force bar
_FULL = 6.0  # N that fill it


def status_table(users: Sequence[TouchStatus], title: str = "") -> Table:
    """A table of what each user feels now."""
    table = Table(title=title or None, title_justify="left", expand=False)
    table.add_column("user", no_wrap=True)
    table.add_column("", no_wrap=True)
    for name in ("force", "from others", "indentation", "K_o", "there and back", "loop"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("late p99", justify="right", no_wrap=True)
    for user in users:
        table.add_row(
            Text(user.name),
            Text(user.state, style=_STYLE.get(user.state, "")),
            Text(f"{bar(user.force)} {user.force:5.2f} N"),
            f"{user.felt_from_others:+5.2f} N",
            f"{1e3 * user.indentation:5.1f} mm",
            f"{user.k_o:4.0f} N/m",
            f"{1e3 * user.round_trip:4.0f} ms",
            f"{user.loop_hz:4.0f} Hz",
            f"{1e6 * user.loop_late_p99:5.0f} us",
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
