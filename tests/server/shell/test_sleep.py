"""A server whose room sleeps while nobody is there, on real sockets."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from cohaptic.protocol.messages import Bye, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Watch
from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.patience import PATIENCE
from tests.server.shell.stage import Served, serving, visit

pytestmark = pytest.mark.live


class Watched:
    """A server of which the ticks are counted that it makes."""

    def __init__(self, served: Served) -> None:
        self.served, self.server, self.made = served, served.server, 0
        tick = self.server.tick

        def counted() -> float:
            self.made += 1
            return tick()

        self.server.tick = counted  # type: ignore[method-assign]

    async def falls_asleep(self) -> None:
        made = -1
        while self.made != made or not self.server.sleeps:
            made, due = self.made, self.server.meters.ticks
            while self.server.meters.ticks == due:
                await asyncio.sleep(0.01)

    async def sleeps_on(self, ticks: int = 100) -> None:
        """Nothing is made of so many ticks that are due."""
        left_out = self.server.meters.left_out
        made, due, number = self.made, self.server.meters.ticks, self.server.room.world.tick
        while self.server.meters.ticks < due + ticks:
            await asyncio.sleep(0.01)
        assert self.made == made
        passed = self.server.meters.ticks - due
        assert self.server.room.world.tick - number == passed
        assert self.server.meters.left_out == left_out  # to sleep is not to miss


def during(body: Balloon, work: Callable[[Watched], Awaitable[None]]) -> None:
    async def play() -> None:
        async with asyncio.timeout(PATIENCE), serving(body) as served:
            watched = Watched(served)
            await watched.falls_asleep()
            await work(watched)

    asyncio.run(play())


def test_a_hand_wakes_it_and_it_sleeps_again_when_the_object_rests(small_balloon: Balloon) -> None:
    async def come(room: Watched) -> None:
        await room.sleeps_on()
        before = room.server.room.world.tick
        async with visit(room.served.url) as hand:
            hand.probe, hand.force = (0.09, 0.0, 0.0), (2.0, 0.0, 0.0)
            await hand.join("left")
            patches = await hand.play(20)
            assert not room.server.sleeps
            assert patches[0].tick > before
            assert patches[-1].own_force[0] > 0.0
            await hand.ws.send(encode_control(Bye()))
            await hand.end()
        await room.falls_asleep()
        await room.sleeps_on()

    during(small_balloon, come)


def test_who_watches_wakes_it_and_sees_tick_after_tick(small_balloon: Balloon) -> None:
    async def come(room: Watched) -> None:
        await room.sleeps_on()
        async with visit(room.served.url) as watcher:
            await watcher.ws.send(encode_control(Watch(protocol=PROTOCOL_VERSION)))
            await watcher.ws.recv()
            made = room.made
            while room.made < made + 10:
                await asyncio.sleep(0.01)
        await room.falls_asleep()

    during(small_balloon, come)
