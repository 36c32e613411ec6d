"""A simulated network link: delay, jitter, losses and stalls, with the semantics of a stream.

A late message delays the messages behind it, so that their order does not change, as on TCP:
independent jitter that reorders messages would test a behaviour that a websocket never has. A lost
message is repeated, and all behind it wait.
"""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final, Generic, TypeVar

from cohaptic.errors import LinkOverflow, SettingError

T = TypeVar("T")

MAX_DELAY = 5.0  # s, for delay and for jitter; longer than on any path on Earth
CAPACITY = 4096  # messages in flight; 10 s (delay and jitter) at 200 Hz is 2,000
# s; longer than the gap between messages over which the extra delay of a link is remembered.
_LONGEST_MEMORY: Final = 60.0
_MAX_LOSS: Final = 0.5  # beyond, repeats of repeats would need an estimate of their own
_MAX_STALLS: Final = 2.0  # 1/s
# s from a loss to its repeat, besides a round trip: the sender notices it by the answers to the
# next three messages (RFC 5681, 3.2), which leave at 60 a second.
_NOTICED: Final = 0.05
# s; what came to an end so long before a message says nothing of a stall at its time.
_IDLE: Final = 30.0
# Largest extra delay of a tail, of its mean: what one message in 20,000 exceeds.
_TAIL_ENDS: Final = 10.0


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """Settings of one direction of a simulated link.

    Args:
        delay: Delay one way [s].
        jitter: Largest extra delay [s]; that of each message is uniformly random in [0, jitter].
        seed: Seed of the random draws; the same seed gives the same draws.
        tail: Mean of a further, exponentially distributed extra delay [s], as queues have.
        memory: Time for which the extra delay of a message is like that of the next ones [s]; 0 for
            independent delays.
        loss: Share of the messages that are lost; each comes a round trip and 50 ms later.
        stall: Longest stall [s], in which nothing comes; each is uniformly random in [0, stall].
        stalls: Mean number of stalls in a second [1/s], at random times.
    """

    delay: float = 0.0
    jitter: float = 0.0
    seed: int = 0
    tail: float = 0.0
    memory: float = 0.0
    loss: float = 0.0
    stall: float = 0.0
    stalls: float = 0.0

    def __post_init__(self) -> None:
        for name, largest, unit in _LIMITS:
            value = getattr(self, name)
            if not 0.0 <= value <= largest:
                limit = f"from 0 to {largest:g}{unit}"
                raise SettingError(f"{name} of a link", f"{value}{unit}", limit)

    @property
    def at_once(self) -> bool:
        """Whether messages pass without any delay."""
        return not any(getattr(self, name) for name, _, _ in _LIMITS if name != "memory")

    @property
    def wavers(self) -> float:
        """Extra delay that hardly any message exceeds, with stalls [s]."""
        return self.longest - self.delay + (self.stall if self.stalls else 0.0)

    @property
    def longest(self) -> float:
        """Delay that hardly any message exceeds, without stalls [s]."""
        repeat = 2.0 * self.delay + _NOTICED if self.loss else 0.0
        return self.delay + self.jitter + 5.0 * self.tail + repeat


# Largest value of each setting, and its unit.
_LIMITS: Final = (
    ("delay", MAX_DELAY, " s"),
    ("jitter", MAX_DELAY, " s"),
    ("tail", MAX_DELAY, " s"),
    ("memory", _LONGEST_MEMORY, " s"),
    ("loss", _MAX_LOSS, ""),
    ("stall", MAX_DELAY, " s"),
    ("stalls", _MAX_STALLS, " /s"),
)
LARGEST: Final = {name: largest for name, largest, _ in _LIMITS}
AT_ONCE: Final = LinkSettings()


class DelayLine(Generic[T]):
    """Queue that delays each message as a link would; the caller passes the time as `now` [s]."""

    def __init__(self, settings: LinkSettings) -> None:
        self.settings = settings
        self._random = random.Random(settings.seed)
        self._items: deque[tuple[float, T]] = deque()
        self._last_due = self._pushed = -math.inf
        self._level = 0.0  # of the extra delay, normally distributed
        self._stall_begins = self._stall_ends = -math.inf
        self._planned = settings  # for which the next stall was drawn

    def __len__(self) -> int:
        return len(self._items)

    def push(self, item: T, now: float) -> float:
        """Send `item` at `now` [s], and return the time at which it is due [s].

        Raises:
            LinkOverflow: `CAPACITY` messages are in flight already.
        """
        if len(self._items) >= CAPACITY:
            raise LinkOverflow(CAPACITY)
        settings = self.settings
        due = now + settings.delay + self._extra(now)
        if settings.loss and self._random.random() < settings.loss:
            due += 2.0 * settings.delay + _NOTICED
        # Stream semantics: no message is due before the message in front of it.
        due = max(self._last_due, due)
        if settings.stalls:
            due = self._after_a_stall(due)
        self._last_due = due
        self._items.append((due, item))
        return due

    def _extra(self, now: float) -> float:
        """Return what jitter and tail add to the delay of the next message [s]."""
        settings = self.settings
        if settings.memory:
            # A normally distributed level that forgets itself, and its share of the distribution.
            gap = max(0.0, now - self._pushed)
            kept = math.exp(-gap / settings.memory)
            self._pushed = now
            fresh = self._random.gauss(0.0, 1.0)
            self._level = kept * self._level + math.sqrt(1.0 - kept * kept) * fresh
            fraction = NormalDist().cdf(self._level)
        else:
            fraction = self._random.uniform(0.0, 1.0)
        extra = fraction * settings.jitter
        if settings.tail:
            extra -= settings.tail * math.log(max(1.0 - fraction, math.exp(-_TAIL_ENDS)))
        return extra

    def _after_a_stall(self, due: float) -> float:
        """Return the time at which a message comes that is due at a time [s], after any stall."""
        settings = self.settings
        if settings is not self._planned:
            self._planned, self._stall_ends = settings, -math.inf
        while due >= self._stall_ends:
            begins = max(self._stall_ends, due - _IDLE)
            self._stall_begins = begins + self._random.expovariate(settings.stalls)
            self._stall_ends = self._stall_begins + self._random.uniform(0.0, settings.stall)
        return self._stall_ends if due >= self._stall_begins else due

    def next_due(self) -> float | None:
        """Return the time at which the next message is due [s]; None if the queue is empty."""
        return self._items[0][0] if self._items else None

    def pop_due(self, now: float) -> list[T]:
        """Remove and return all messages that are due at `now` [s], in the order of sending."""
        due: list[T] = []
        while self._items and self._items[0][0] <= now:
            due.append(self._items.popleft()[1])
        return due
