"""Network links of the compiled room: delay, jitter, loss, and messages that stay in order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cohaptic_experiments.campaign.compiled import compiled
from cohaptic_server.numeric import Floats, Ints

SLOTS = 128  # messages in flight on one link; the longest delay, 0.65 s, holds 65 of them at 100 Hz


class Queue(NamedTuple):
    """Messages in flight between each of n users and the server, as ring buffers.

    Fields:
        due: Time of arrival of each message, shape (n, SLOTS) [s].
        payload: Numbers of each message, shape (n, SLOTS, m).
        pushed: Messages sent so far, shape (n,).
        popped: Messages received so far, shape (n,).
        latest: Arrival of the newest message, before which no later one may arrive, shape (n,) [s].
    """

    due: Floats
    payload: Floats
    pushed: Ints
    popped: Ints
    latest: Floats


@compiled
def empty_queue(users: int, numbers: int) -> Queue:
    """Links without messages.

    Args:
        users: How many links there are.
        numbers: Length of a message's payload.
    """
    return Queue(
        np.zeros((users, SLOTS)),
        np.zeros((users, SLOTS, numbers)),
        np.zeros(users, np.int64),
        np.zeros(users, np.int64),
        np.zeros(users),
    )


@compiled
def send(queue: Queue, user: int, due: float, payload: Floats | tuple[float, ...]) -> None:
    """Enqueue a message.

    Args:
        queue: Links of all users.
        user: Index of the link.
        due: Time of arrival, raised to that of the message before so that order is kept [s].
        payload: Numbers of the message.
    """
    slot = queue.pushed[user] % SLOTS
    queue.latest[user] = max(queue.latest[user], due)
    queue.due[user, slot] = queue.latest[user]
    for a in range(len(payload)):
        queue.payload[user, slot, a] = payload[a]
    queue.pushed[user] += 1


@compiled
def receive(queue: Queue, user: int, now: float) -> int:
    """Take the oldest message that has arrived; returns its slot, or -1 when there is none.

    Args:
        queue: Links of all users.
        user: Index of the link.
        now: [s].
    """
    slot = queue.popped[user] % SLOTS
    if queue.popped[user] == queue.pushed[user] or queue.due[user, slot] > now:
        return -1
    queue.popped[user] += 1
    return int(slot)
