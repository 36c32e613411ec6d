"""The shell on real sockets: users who come, go and stall."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from cohaptic.control.law import Law
from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import (
    Bye,
    FixedGains,
    ServerControl,
    SetLaw,
    UserJoined,
    UserLeft,
    encode_control,
)
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.version import SUBPROTOCOL
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.room.life import HELLO_TIMEOUT
from cohaptic_server.room.outbox import MAX_EVENTS
from cohaptic_server.room.seats.names import REPLACE_AFTER
from cohaptic_server.shell.server import CLOSE_TIMEOUT
from tests.patience import PATIENCE
from tests.server.peers import hello_text
from tests.server.shell.stage import SIMULATION_HZ, Client, Stage, names, serving, visit

pytestmark = pytest.mark.live

BAD = CloseCode.BAD_MESSAGE.value


async def news_of(client: Client, name: str) -> list[UserJoined | UserLeft]:
    """What is heard of a user until it has left."""
    async with asyncio.timeout(PATIENCE):
        while True:
            about = [n for n in client.news if isinstance(n, UserJoined | UserLeft)]
            about = [n for n in about if n.name == name]
            if about and isinstance(about[-1], UserLeft):
                return about
            await client.play(1)


async def says_bye(client: Client) -> None:
    await client.ws.send(encode_control(Bye()))
    assert (await client.end())[:2] == (1000, "bye")


async def is_cut_off(client: Client) -> None:
    client.ws.transport.abort()


async def draws_on_terminals(client: Client) -> None:
    await client.ws.close(1000, "\x1b[2Jroot logged in\nfrom here")


@pytest.mark.parametrize(
    ("leaves", "reason"),
    [
        (says_bye, "bye"),
        (is_cut_off, "connection lost"),
        (draws_on_terminals, "?[2Jroot logged in?from here"),
    ],
)
def test_coming_and_leaving_is_news_to_the_others_in_order(
    stage: Stage, leaves: Callable[[Client], Coroutine[Any, Any, None]], reason: str
) -> None:
    """Whatever a stranger says at the end, the others' terminals survive it."""
    name = next(names)

    async def come_and_go() -> int:
        async with visit(stage.url) as client:
            user = await client.join(name)
            await leaves(client)
            return user

    user = stage.during(come_and_go())
    joined, left = stage.runner.run(news_of(stage.steady, name))
    assert joined == UserJoined(user=user, name=name)
    assert left == UserLeft(user=user, name=name, reason=reason)


def test_who_says_nothing_is_let_go_after_the_timeout(stage: Stage) -> None:
    async def wait() -> tuple[int, str]:
        async with visit(stage.url) as client:
            await stage.steady.play(2)
            stage.server.clock.origin += HELLO_TIMEOUT
            _, (code, reason, _) = await asyncio.gather(stage.steady.play(4), client.end())
            return code, reason

    code, reason = stage.runner.run(wait())
    assert code == CloseCode.HELLO_TIMEOUT.value
    assert reason == "time without a hello is '5 s'; expected a hello within it"


def test_a_silent_users_return_takes_its_place_and_the_others_hear_of_both(stage: Stage) -> None:
    name = next(names)

    async def replaced() -> tuple[list[int], int, str]:
        async with visit(stage.url) as old, visit(stage.url) as new:
            numbers = [await old.join(name)]
            await stage.steady.play(2)
            stage.server.clock.origin += REPLACE_AFTER
            await stage.steady.play(2)
            numbers.append(await new.join(name))
            code, reason, _ = await old.end()
            await new.play(2)
            await says_bye(new)
            return numbers, code, reason

    (first, second), code, reason = stage.runner.run(replaced())
    assert code == CloseCode.BAD_MESSAGE.value
    assert f"user is '{name}'; expected its only connection" in reason
    stage.runner.run(news_of(stage.steady, name))
    stage.during(asyncio.sleep(0))
    about = [n for n in stage.steady.news if isinstance(n, UserJoined | UserLeft)]
    assert [(type(n), n.user) for n in about if n.name == name] == [
        (UserJoined, first),
        (UserLeft, first),
        (UserJoined, second),
        (UserLeft, second),
    ]


def test_a_client_that_stops_reading_costs_little_and_delays_nobody(stage: Stage) -> None:
    """Its patches wait where newer ones replace them, and others cannot get it closed."""
    slow = next(names)

    async def stall() -> tuple[list[int], list[ServerControl]]:
        small = socket.socket()
        small.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        host, port = stage.url.removeprefix("ws://").split(":")
        small.connect((host, int(port)))
        small.setblocking(False)
        async with visit(stage.url, sock=small) as client:
            user = await client.join(slow)
            await client.play(3)
            client.ws.transport.pause_reading()
            (at_server,) = (c for c in stage.server.connections if c.user == user)
            outbox = at_server.session.outbox
            while outbox.patches_skipped < 20:
                await asyncio.sleep(1.0 / SIMULATION_HZ)
                # One patch of 88 bytes and its header, at most, is with the transport.
                assert at_server.ws.transport.get_write_buffer_size() < 128
            # Without sockets, since the client may not be deaf for as long as those would take.
            session_host, now = stage.server.session_host, stage.server.clock.now()
            for _ in range(MAX_EVENTS):
                stranger = session_host.connect(now, SUBPROTOCOL, None, "elsewhere")
                for said in (hello_text(next(names)), encode_control(Bye())):
                    session_host.receive(stranger, said, now, 0.0)
                session_host.disconnect(stranger, "")
            assert at_server.session.close is None
            client.ws.transport.resume_reading()
            patches = await client.play(40)
            heard = len(client.news)
            async with visit(stage.url) as other:
                await other.join(next(names))
                await says_bye(other)
            while len(client.news) < heard + 2:
                patches += await client.play(1)
            return [patch.tick for patch in patches], client.news[1:]

    ticks, news = stage.during(stall(), patches=100)
    # Fewer, and never older; and of those who came and left nothing, but for what was on its way.
    assert ticks == sorted(set(ticks))
    assert ticks[-1] - ticks[0] > len(ticks)
    assert len(news) < MAX_EVENTS


def test_a_server_that_stops_tells_everybody(small_balloon: Balloon) -> None:
    """Those who play, and those who have not said a word."""

    async def play() -> list[tuple[int, str]]:
        async with (
            serving(small_balloon) as served,
            visit(served.url) as joined,
            visit(served.url) as silent,
        ):
            await joined.join("left")
            await joined.play(2)
            ends = asyncio.gather(joined.end(), silent.end())
            await served.stop()
            return [end[:2] for end in await ends]

    assert asyncio.run(play()) == [(CloseCode.SERVER_STOPS.value, "the server stops")] * 2


def test_a_server_that_stops_does_not_wait_for_who_does_not_answer(small_balloon: Balloon) -> None:
    async def play() -> float:
        async with serving(small_balloon) as served, visit(served.url, close_timeout=0) as deaf:
            await deaf.join("left")
            deaf.ws.transport.pause_reading()
            clock = asyncio.get_running_loop()
            begun = clock.time()
            await served.stop()
            return clock.time() - begun

    # Half a second for a slow machine.
    assert CLOSE_TIMEOUT <= asyncio.run(play()) < CLOSE_TIMEOUT + 0.5


def test_a_user_whom_no_patch_can_reach_stays_and_is_reported_once(
    small_balloon: Balloon, caplog: pytest.LogCaptureFixture
) -> None:
    """Connected and silent for twelve days: its wait is no number that a patch may carry."""

    async def play() -> tuple[int, int, Patch]:
        async with serving(small_balloon) as served, visit(served.url) as silent:
            await silent.join("silent")
            await silent.touch()
            await silent.hear()  # a patch: its sample is there
            served.server.clock.origin += 1.1e6
            async with visit(served.url) as other:
                await other.join("other")
                others = len(await other.play(20))
            left_out = served.server.room.world.tick
            # Its next sample ends it: patches come as before.
            await silent.touch()
            while True:
                message = await silent.hear()
                if isinstance(message, Patch) and message.seq == silent.seq:
                    return others, left_out, message

    with caplog.at_level(logging.WARNING, "cohaptic.server"):
        others, left_out, back = asyncio.run(play())
    assert others == 20
    assert back.tick >= left_out > 20
    (once,) = [record.getMessage() for record in caplog.records]
    assert once.startswith("silent gets no patch: sample_wait is 1100000.")


def test_gains_of_ones_own_are_refused_unless_the_server_allows_them(stage: Stage) -> None:
    async def ask() -> tuple[int, str]:
        async with visit(stage.url) as client:
            await client.join(next(names))
            await client.ws.send(
                encode_control(SetLaw(law=Law.PI, fixed_gains=FixedGains(k_h=5000.0)))
            )
            code, reason, _ = await client.end()
            return code, reason

    code, reason = stage.during(ask())
    assert code == BAD
    assert "--allow-fixed-gains" in reason
