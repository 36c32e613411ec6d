"""Lines of text on the state of hands, for a log or a pipe, and the summary of a visit."""

from __future__ import annotations

from cohaptic.status.report import TouchStatus

EVERY = 1.0  # s between two lines if the output is not a terminal


def status_line(user: TouchStatus) -> str:
    """One line on the present state of a hand."""
    parts = [user.state]
    if user.state == "touching":
        parts += [f"{user.force:.2f} N", f"{user.felt_from_others:+.2f} N of others"]
        parts += [f"{1e3 * user.indentation:.1f} mm deep", f"K_o {user.k_o:.0f} N/m"]
    parts += [f"force off: {user.fault}"] if user.fault else []
    return f"{user.name}: {', '.join(parts)}"


class Summary:
    """Summary of a visit, collected from readings and printed at the end.

    Args:
        began: Time at which the visit began [s].
    """

    def __init__(self, began: float) -> None:
        self._began = began
        self._before: float | None = None  # time of the previous reading, if the hand touched then
        self._touched = 0.0
        self._highest = 0.0
        self._last: TouchStatus | None = None

    def read(self, user: TouchStatus, now: float) -> None:
        """Add a reading taken at time `now` [s]."""
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
        """The summary, with the last measurements of loop and network; empty if there are none."""
        user = self._last
        if user is None:
            return ""
        return (
            f"{user.name}: touched for {self._touched:.0f} of {now - self._began:.0f} s, at most"
            f" {self._highest:.2f} N shown; round trip {1e3 * user.round_trip:.0f} ms; loop"
            f" {user.loop_hz:.0f} Hz, {user.loop_missed} periods left out"
        )
