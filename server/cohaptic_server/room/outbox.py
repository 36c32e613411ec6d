"""What waits to be sent to one user: events in order, and the newest patch.

What happens to a client that cannot keep up: a patch that was not sent yet is replaced by the next
one, so a slow client gets fewer and never older; events (somebody joined, an error) are never
dropped, and a client that lets `MAX_EVENTS` of them pile up is disconnected and told why.
"""

from __future__ import annotations

from collections import deque

MAX_EVENTS = 64


class Outbox:
    """Bounded by construction: at most `MAX_EVENTS` events and one patch."""

    def __init__(self) -> None:
        self._events: deque[str | bytes] = deque()
        self._patch: bytes | None = None
        self.patches_skipped = 0

    def put_event(self, data: str | bytes) -> bool:
        """Queue an event: text, or a frame that is not a state (the resting mesh).

        False when the queue is full, which ends the session.
        """
        if len(self._events) >= MAX_EVENTS:
            return False
        self._events.append(data)
        return True

    def put_patch(self, frame: bytes) -> None:
        """Replace the patch that waits."""
        if self._patch is not None:
            self.patches_skipped += 1
        self._patch = frame

    def take(self, *, clear: bool) -> list[str | bytes]:
        """What to write now: every event, then the patch.

        Args:
            clear: Whether the last write has left the process. If not, nothing is taken, and the
                patch waits here, where a newer one can replace it.
        """
        if not clear:
            return []
        out: list[str | bytes] = [*self._events]
        self._events.clear()
        if self._patch is not None:
            out.append(self._patch)
            self._patch = None
        return out
