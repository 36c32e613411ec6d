"""Latency that a page injects into a served room."""

from __future__ import annotations

import asyncio

import pytest

from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.watch_messages import (
    Latency,
    SetLatency,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from tests.server.room.watch.pages import watching
from tests.server.shell.stage import SIMULATION_HZ, Client, serving, visit

pytestmark = pytest.mark.live


def test_injected_latency_delays_both_ways_is_told_to_all_and_stops(
    small_balloon: Balloon,
) -> None:
    delay = 0.1  # s

    async def round_trip(client: Client) -> int:
        """Ticks from the newest patch until the one that contains the next sample."""
        newest = (await client.play(1))[0].tick
        await client.touch()
        seq = client.seq
        while True:
            (patch,) = await client.play(1)
            if patch.seq >= seq:
                return patch.tick - newest

    async def play() -> tuple[int, int, int]:
        async with (
            serving(small_balloon, allow_latency=True) as served,
            watching(served.url) as page,
            watching(served.url) as other,
            visit(served.url) as client,
        ):
            assert page.watching.allow_latency
            user = await client.join("ann")
            await client.touch()
            before = await round_trip(client)
            change = SetLatency(user=user, delay=delay)
            await page.ws.send(encode_control(change))
            news = Latency(user=user, delay=delay, jitter=0.0)
            for one in (page, other):
                assert await one.told(Latency) == news
            async with watching(served.url) as late:
                assert await late.told(Latency) == news
            during = max([await round_trip(client) for _ in range(3)])
            # One who is not there is passed over; a fool's rush is one piece of news.
            await page.ws.send(encode_control(SetLatency(user=999, delay=1.0)))
            await page.ws.send(encode_control(SetLatency(user=user, delay=0.0)))
            assert await other.told(Latency) == Latency(user=user, delay=0.0, jitter=0.0)
            after = [await round_trip(client) for _ in range(4)]
            return before, during, after[-1]

    before, during, after = asyncio.run(play())
    # More than one way, in ticks of the server, of which a busy machine leaves some out.
    assert during >= 1.5 * delay * SIMULATION_HZ
    assert after <= before + 0.5 * delay * SIMULATION_HZ
