"""Queue of messages to one peer: events in order, and the newest patch.

A patch that was not sent yet is replaced by the next one, so that a client that cannot keep up gets
fewer patches and never older ones. Events (somebody joined, an error) are never dropped; a client
for which `MAX_EVENTS` of them wait is disconnected and told why.
"""

from __future__ import annotations

from collections import deque

MAX_EVENTS = 64


class Outbox:
    """At most `MAX_EVENTS` events and one patch.

    Attributes:
        patches_skipped: Patches that were replaced before they were sent.
    """

    def __init__(self) -> None:
        self._events: deque[str | bytes] = deque()
        self._patch: bytes | None = None
        self.patches_skipped = 0

    @property
    def empty(self) -> bool:
        """Whether nothing waits."""
        return self._patch is None and not self._events

    def put_event(self, data: str | bytes) -> bool:
        """Queue an event: text, or a frame that no later one replaces (the resting mesh).

        Returns:
            False when the queue is full, which ends the session.
        """
        if len(self._events) >= MAX_EVENTS:
            return False
        self._events.append(data)
        return True

    def put_patch(self, frame: bytes) -> None:
        """Queue a patch in place of the one that waits."""
        if self._patch is not None:
            self.patches_skipped += 1
        self._patch = frame

    def take(self, *, clear: bool) -> list[str | bytes]:
        """Remove and return the messages to write now: every event, then the patch.

        Args:
            clear: Whether the last write has left the process. If not, nothing is returned, and the
                patch waits here, where a newer one can replace it.
        """
        if not clear:
            return []
        messages: list[str | bytes] = []
        if self._events:
            messages += self._events
            self._events.clear()
        if self._patch is not None:
            messages.append(self._patch)
            self._patch = None
        return messages
