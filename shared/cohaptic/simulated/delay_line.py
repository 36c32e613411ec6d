"""A simulated network link: delay and jitter with the semantics of a stream.

A late message delays the messages behind it, so that their order does not change, as on TCP:
independent jitter that reorders messages would test a behaviour that a websocket never has.
"""

from __future__ import annotations

import random
from collections import deque
from dataclasses import dataclass
from typing import Generic, TypeVar

from cohaptic.errors import LinkOverflow, SettingError

T = TypeVar("T")

MAX_DELAY = 5.0  # s, for delay and for jitter; longer than on any path on Earth
CAPACITY = 4096  # messages in flight; 10 s (delay and jitter) at 200 Hz is 2,000


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """Settings of one direction of a simulated link.

    Args:
        delay: Delay one way [s].
        jitter: Largest extra delay [s]; that of each message is uniformly random in [0, jitter].
        seed: Seed of the random draws; the same seed gives the same draws.
    """

    delay: float = 0.0
    jitter: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("delay", "jitter"):
            value = getattr(self, name)
            if not 0.0 <= value <= MAX_DELAY:
                raise SettingError(f"{name} of a link", f"{value} s", f"from 0 to {MAX_DELAY} s")


class DelayLine(Generic[T]):
    """Queue that delays each message as a link would; the caller passes the time as `now` [s]."""

    def __init__(self, settings: LinkSettings) -> None:
        self.settings = settings
        self._random = random.Random(settings.seed)
        self._items: deque[tuple[float, T]] = deque()
        self._last_due = float("-inf")

    def __len__(self) -> int:
        return len(self._items)

    def push(self, item: T, now: float) -> float:
        """Send `item` at `now` [s], and return the time at which it is due [s].

        Raises:
            LinkOverflow: `CAPACITY` messages are in flight already.
        """
        if len(self._items) >= CAPACITY:
            raise LinkOverflow(CAPACITY)
        extra = self._random.uniform(0.0, self.settings.jitter)
        # Stream semantics: no message is due before the message in front of it.
        self._last_due = max(self._last_due, now + self.settings.delay + extra)
        self._items.append((self._last_due, item))
        return self._last_due

    def next_due(self) -> float | None:
        """Return the time at which the next message is due [s]; None if the queue is empty."""
        return self._items[0][0] if self._items else None

    def pop_due(self, now: float) -> list[T]:
        """Remove and return all messages that are due at `now` [s], in the order of sending."""
        due: list[T] = []
        while self._items and self._items[0][0] <= now:
            due.append(self._items.popleft()[1])
        return due
