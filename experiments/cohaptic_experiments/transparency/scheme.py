"""Schemes: ways in which several hands can be coupled, tried with the same hands and links.

A scheme says what each client does in a haptic period and what the server does in a tick. The
session gives it the delay lines, the devices and their hands. `Product` is this program; another
scheme is a baseline, or an idea that is tried before it is built.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from cohaptic.simulated.delay_line import AT_ONCE, DelayLine
from cohaptic.simulated.delay_line import LinkSettings as Link
from cohaptic.vec import Vec3, norm
from cohaptic_client.devices.device import Device, DeviceSample
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.numeric import Floats

Message = TypeVar("Message")
Up = TypeVar("Up")
Down = TypeVar("Down")


class Arrived(NamedTuple, Generic[Message]):
    """A message to the server, and the time at which it came [s]."""

    at: float
    message: Message


class Scheme(Protocol[Up, Down]):
    """A way in which hands are coupled. Users have the numbers 0 to n - 1."""

    @property
    def period(self) -> float:
        """Time between two ticks of the server [s]."""
        ...

    def client(
        self, user: int, now: float, sample: DeviceSample, inbox: Sequence[Down]
    ) -> tuple[Vec3, Up | None]:
        """Compute one haptic period of a user's client.

        Args:
            user: Number of the user.
            now: Time of the period [s].
            sample: State of the device's tip.
            inbox: Messages that have come from the server since the last period, oldest first.

        Returns:
            Force on the hand [N], and a message to the server; None to send none.
        """
        ...

    def server(
        self, now: float, inboxes: Mapping[int, Sequence[Arrived[Up]]]
    ) -> Mapping[int, Down]:
        """Compute one tick of the server.

        Args:
            now: Time of the tick [s].
            inboxes: Messages that have come from each user since the last tick, oldest first.

        Returns:
            A message for each user who gets one.
        """
        ...


AnyScheme = Scheme[Any, Any]


# Of the ticks that come late, the share that comes two periods late; the others come one late.
_LATEST: Final = 1.0 / 3.0


class SchemeSession(Generic[Up, Down]):
    """Hands that a scheme couples, in virtual time.

    Args:
        scheme: Way of coupling.
        devices: Device with a hand of each user.
        link: Link of every user; the draws of each follow from its seed.
        late_ticks: Share of the server's ticks that come one or two periods late.
    """

    def __init__(
        self,
        scheme: Scheme[Up, Down],
        devices: Sequence[Device],
        link: Link = AT_ONCE,
        late_ticks: float = 0.0,
    ) -> None:
        self.scheme, self.devices, self.now = scheme, devices, 0.0
        self._late_ticks, self._chance = late_ticks, random.Random(link.seed + 99)
        self._next_tick = 0.0
        users = range(len(devices))
        self._up = [DelayLine[Up](_settings(link, 2 * user)) for user in users]
        self._down = [DelayLine[Down](_settings(link, 2 * user + 1)) for user in users]
        self._came: dict[int, list[Arrived[Up]]] = {user: [] for user in users}

    def run(self, seconds: float) -> tuple[Floats, Floats]:
        """Let time pass; return each tip, (n, 3, t) [m], and the size of each force, (n, t) [N]."""
        steps, n = round(seconds / PERIOD), len(self.devices)
        tips, forces = np.empty((n, 3, steps)), np.empty((n, steps))
        for k in range(steps):
            self.now += PERIOD
            for user, line in enumerate(self._up):
                self._came[user] += [
                    Arrived(self.now, reported) for reported in line.pop_due(self.now)
                ]
            if self.now >= self._next_tick:
                self._next_tick += self.scheme.period * self._periods()
                for user, message in self.scheme.server(self.now, self._came).items():
                    self._down[user].push(message, self.now)
                self._came = {user: [] for user in range(n)}
            for user, device in enumerate(self.devices):
                sample, inbox = device.read(self.now), self._down[user].pop_due(self.now)
                force, reported = self.scheme.client(user, self.now, sample, inbox)
                device.write(force)
                if reported is not None:
                    self._up[user].push(reported, self.now)
                tips[user, :, k], forces[user, k] = sample.position, norm(force)
        return tips, forces

    def _periods(self) -> int:
        """Return the number of periods until the next tick."""
        if not self._late_ticks:
            return 1
        fraction = self._chance.random() / self._late_ticks
        return 1 if fraction >= 1.0 else 2 if fraction >= _LATEST else 3


def _settings(link: Link, number: int) -> Link:
    return replace(link, seed=1000 * link.seed + number)
