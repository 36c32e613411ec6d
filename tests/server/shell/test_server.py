"""The shell on real sockets: what only it can get wrong. Rules are tested in `test_session.py`.

One server and one well-behaved user stand through most tests; between them their loop rests.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import socket
import struct
from collections.abc import AsyncGenerator, Callable, Coroutine, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Origin, Subprotocol

from cohaptic.control.law import Law
from cohaptic.errors import CloseCode, SettingError
from cohaptic.protocol.messages import (
    Bye,
    Error,
    FixedGains,
    ServerControl,
    SetLaw,
    UserJoined,
    UserLeft,
    Welcome,
    decode_server_control,
    encode_control,
)
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.vec import Vec3, norm
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.room.outbox import MAX_EVENTS
from cohaptic_server.room.room import REPLACE_AFTER
from cohaptic_server.room.session import HELLO_TIMEOUT
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.listener import MAX_INBOUND_BYTES
from cohaptic_server.shell.server import CLOSE_TIMEOUT, CohapticServer
from tests.server.peers import hello, hello_text, sample, text

SIMULATION_HZ = 200.0  # the fastest: more happens in a test of a tenth of a second
PATIENCE = 10.0  # s; far more than anything here takes on an idle machine
FAR: Vec3 = (0.0, 0.5, 0.0)  # m; nobody's neighbour
ZERO: Vec3 = (0.0, 0.0, 0.0)

T = TypeVar("T")
names = (f"visitor{i}" for i in itertools.count())


@dataclass
class Client:
    """A user whose samples follow its patches.

    Attributes:
        ws: Its connection.
        news: Control messages so far.
        probe, force: Of its samples.
    """

    ws: ClientConnection
    news: list[ServerControl] = field(default_factory=list[ServerControl])
    probe: Vec3 = FAR
    force: Vec3 = ZERO
    seq: int = 0

    async def hear(self) -> Patch | ServerControl:
        """The next message from the server."""
        data = await self.ws.recv()
        if isinstance(data, bytes):
            return Patch.decode(data)
        self.news.append(decode_server_control(data))
        return self.news[-1]

    async def join(self, name: str) -> int:
        """Come in; the own number."""
        await self.ws.send(hello_text(name))
        answer = await self.hear()
        assert isinstance(answer, Welcome)
        return answer.user

    async def touch(self) -> None:
        self.seq += 1
        await self.ws.send(sample(self.seq, self.probe, self.force).encode())

    async def play(self, patches: int) -> list[Patch]:
        """Take part until so many patches have come."""
        if not self.seq:
            await self.touch()
        found: list[Patch] = []
        while len(found) < patches:
            message = await self.hear()
            if isinstance(message, Patch):
                found.append(message)
                await self.touch()
        return found

    async def end(self) -> tuple[int, str, list[Patch]]:
        """Listen until the server closes; its code and reason, and the patches until then."""
        found: list[Patch] = []
        with contextlib.suppress(ConnectionClosed):
            while True:
                message = await self.hear()
                if isinstance(message, Patch):
                    found.append(message)
        assert self.ws.close_code is not None
        return self.ws.close_code, self.ws.close_reason or "", found


@contextlib.asynccontextmanager
async def visit(
    url: str, subprotocols: Sequence[str] = (SUBPROTOCOL,), **options: Any
) -> AsyncGenerator[Client]:
    offered = [Subprotocol(name) for name in subprotocols] or None
    async with (
        asyncio.timeout(PATIENCE),
        connect(url, subprotocols=offered, compression=None, proxy=None, **options) as ws,
    ):
        yield Client(ws)


@dataclass
class Serving:
    """A server that ticks."""

    server: CohapticServer
    url: str
    ticking: asyncio.Task[None]

    async def stop(self) -> None:
        self.ticking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self.ticking


@contextlib.asynccontextmanager
async def serving(body: Body, max_users: int = 64, **more: Any) -> AsyncGenerator[Serving]:
    settings = ServerSettings(port=0, simulation_hz=SIMULATION_HZ, max_users=max_users, **more)
    server = CohapticServer(body, settings)
    url = await server.start()
    served = Serving(server, url, asyncio.ensure_future(server.run()))
    try:
        yield served
    finally:
        await served.stop()


@dataclass
class Stage:
    """A server, a user who presses and does nothing wrong, and the loop in which they live."""

    runner: asyncio.Runner
    server: CohapticServer
    url: str
    steady: Client

    def during(self, happening: Coroutine[Any, Any, T], patches: int = 12) -> T:
        """Let something happen; the steady user must not notice.

        Args:
            happening: What other clients do.
            patches: How many the steady user takes meanwhile.
        """
        return self.runner.run(self._during(happening, patches))

    async def _during(self, happening: Coroutine[Any, Any, T], patches: int) -> T:
        async with asyncio.timeout(PATIENCE):
            last = await self._settled()
            async with asyncio.TaskGroup() as both:
                result = both.create_task(happening)
                felt = both.create_task(self.steady.play(patches))
        assert norm(last.own_force) > 1.0
        for number, patch in enumerate(felt.result(), start=last.tick + 1):
            assert surface(patch) == surface(last)
            assert patch.tick == number
        return result.result()

    async def _settled(self) -> Patch:
        """A patch of now that is like the one before: no force still rises."""
        now = self.server.room.world.tick
        before, last = await self.steady.play(2)
        while last.tick <= now or surface(before) != surface(last):
            before, last = last, (await self.steady.play(1))[0]
        return last


def surface(patch: Patch) -> Patch:
    """What of a patch the hand feels."""
    return replace(patch, tick=1, seq=0, t_server=0.0, t_client=0.0, sample_wait=0.0)


@pytest.fixture(scope="module")
def stage(small_balloon: Balloon) -> Iterator[Stage]:
    with asyncio.Runner() as runner:
        context = contextlib.AsyncExitStack()

        async def begin() -> Stage:
            served = await context.enter_async_context(serving(small_balloon))
            ws = await connect(
                served.url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, proxy=None
            )
            steady = Client(ws, probe=(0.09, 0.0, 0.0), force=(2.0, 0.0, 0.0))
            context.push_async_callback(steady.end)
            context.push_async_callback(steady.ws.send, encode_control(Bye()))
            await steady.join("steady")
            return Stage(runner, served.server, served.url, steady)

        yield runner.run(begin())
        runner.run(context.aclose())


def spoiled(offset: int, value: float) -> bytes:
    """A sample with one number that no client of ours can send."""
    frame = bytearray(sample().encode())
    struct.pack_into("<f", frame, offset, value)
    return bytes(frame)


PROBE, FORCE = 20, 32  # offsets in a contact sample
BAD, VERSION = CloseCode.BAD_MESSAGE.value, CloseCode.WRONG_VERSION.value


@pytest.mark.parametrize(
    ("said", "code", "words"),
    [
        pytest.param("hello again", BAD, "Invalid JSON", id="garbage"),
        pytest.param("", BAD, "Invalid JSON", id="empty text"),
        pytest.param(
            text("dance"),
            BAD,
            "'dance' found using 'type' does not match any of the expected tags",
            id="unknown message",
        ),
        pytest.param(
            hello_text("twice"),
            BAD,
            "message is 'Hello'; expected ContactSample or SetLaw or Bye",
            id="second hello",
        ),
        pytest.param(b"", BAD, "frame length is 0; expected at least 4 bytes", id="empty frame"),
        pytest.param(
            sample().encode()[:-1],
            BAD,
            "contact_sample length is 43; expected 44 bytes",
            id="truncated frame",
        ),
        pytest.param(
            sample().encode() + bytes(84),
            BAD,
            "contact_sample length is 128; expected 44 bytes",
            id="long frame",
        ),
        pytest.param(
            bytes([PROTOCOL_VERSION, 2]) + sample().encode()[2:],
            BAD,
            "frame kind is 2; expected 1",
            id="wrong kind",
        ),
        pytest.param(
            b"\x09" + sample().encode()[1:],
            VERSION,
            f"protocol version is 9; expected {PROTOCOL_VERSION}",
            id="other version",
        ),
        pytest.param(
            spoiled(PROBE, float("nan")),
            BAD,
            "probe is nan; expected a finite number",
            id="position nan",
        ),
        pytest.param(
            spoiled(FORCE, float("inf")),
            BAD,
            "force is inf; expected a finite number",
            id="force inf",
        ),
        pytest.param(
            spoiled(PROBE, 1000.0),
            BAD,
            "length of probe is '1000 m'; expected <= 10",
            id="absurd position",
        ),
        pytest.param(
            spoiled(FORCE, 5000.0),
            BAD,
            "length of force is '5000 N'; expected <= 100",
            id="absurd force",
        ),
        pytest.param(
            sample(1).encode(),
            BAD,
            "seq of a contact sample is 1; expected more than the last",
            id="falling seq",
        ),
        pytest.param("x" * MAX_INBOUND_BYTES, BAD, "Invalid JSON", id="long text"),
        pytest.param(
            bytes(MAX_INBOUND_BYTES + 1),
            1009,
            "4097 bytes exceeds limit of 4096 bytes",
            id="oversize frame",
        ),
        pytest.param(
            "x" * 100_000, 1009, "100000 bytes exceeds limit of 4096 bytes", id="oversize text"
        ),
    ],
)
def test_a_user_who_breaks_a_rule_is_told_and_closed_and_nobody_else_notices(
    stage: Stage, said: str | bytes, code: int, words: str
) -> None:
    async def offend() -> tuple[int, str, list[ServerControl]]:
        async with visit(stage.url) as client:
            await client.join(next(names))
            await client.touch()
            await client.ws.send(said)
            got, reason, _ = await client.end()
            return got, reason, client.news

    got, reason, news = stage.during(offend())
    assert got == code
    told = [message for message in news if isinstance(message, Error)]
    if code == 1009:
        # The websocket's own limit: the frame was never read, so the close alone says it.
        assert told == []
        assert words in reason
    else:
        assert [error.code for error in told] == [code]
        assert words in told[0].message
        assert told[0].message.startswith(reason)
        assert reason


def test_another_version_is_accepted_to_be_told(stage: Stage) -> None:
    """A browser drops a connection whose subprotocol is not accepted, and hears no reason."""

    async def offer() -> tuple[str | None, int]:
        async with visit(stage.url, ["chat", "cohaptic.v1"]) as client:
            chosen = client.ws.subprotocol
            return chosen, (await client.end())[0]

    assert stage.during(offer()) == ("cohaptic.v1", VERSION)


@pytest.mark.parametrize(
    ("said", "subprotocols", "code", "words"),
    [
        pytest.param(
            None,
            ["chat"],
            VERSION,
            f"protocol version is 'chat'; expected {PROTOCOL_VERSION}: install the same",
            id="wrong subprotocol",
        ),
        pytest.param(
            None,
            [],
            VERSION,
            "protocol version is 'not named as a subprotocol'",
            id="no subprotocol",
        ),
        pytest.param(
            text("hello", protocol=99, name="x"),
            None,
            VERSION,
            f"protocol version is 99; expected {PROTOCOL_VERSION}",
            id="wrong version",
        ),
        pytest.param(
            hello_text("steady"),
            None,
            CloseCode.NAME_TAKEN.value,
            "(taken: steady)",
            id="name taken",
        ),
        pytest.param(
            text("hello", protocol=1, name="a\nb"),
            None,
            BAD,
            "hello.name is 'a\\nb'; expected",
            id="spoilt name",
        ),
        pytest.param(
            encode_control(Bye()),
            None,
            BAD,
            "message is 'Bye'; expected Hello or Watch: waits for hello",
            id="bye before hello",
        ),
        pytest.param(
            sample().encode(),
            None,
            BAD,
            "message is 'ContactSample'; expected Hello",
            id="sample before hello",
        ),
    ],
)
def test_who_cannot_come_in_is_told_why_and_nobody_else_notices(
    stage: Stage, said: str | bytes | None, subprotocols: list[str] | None, code: int, words: str
) -> None:
    async def offend() -> tuple[int, str, list[ServerControl]]:
        offered = [SUBPROTOCOL] if subprotocols is None else subprotocols
        async with visit(stage.url, offered) as client:
            if said is not None:
                await client.ws.send(said)
            got, reason, _ = await client.end()
            return got, reason, client.news

    heard = len(stage.steady.news)
    got, reason, news = stage.during(offend())
    assert got == code
    (error,) = news
    assert isinstance(error, Error)
    assert error.code == code
    assert words in error.message
    assert error.message.startswith(reason)
    assert reason
    assert stage.steady.news[heard:] == []


def test_a_full_room_is_told_as_that(small_balloon: Balloon) -> None:
    async def play() -> tuple[int, str]:
        async with (
            serving(small_balloon, max_users=1) as served,
            visit(served.url) as first,
            visit(served.url) as second,
        ):
            await first.join("first")
            await second.ws.send(hello_text("second"))
            return (await second.end())[:2]

    assert asyncio.run(play()) == (
        CloseCode.ROOM_FULL.value,
        "number of users is 2; expected at most 1",
    )


@pytest.mark.parametrize(
    ("origin", "welcome"),
    [
        ("http://localhost:5173", True),
        ("https://127.0.0.1", True),
        ("http://[::1]:80", True),
        ("https://elsewhere.example", False),
        ("http://localhost.elsewhere.example", False),
        ("http://localhost@elsewhere.example", False),
        ("null", False),
    ],
)
def test_only_a_page_of_this_machine_may_use_a_visitors_browser(
    stage: Stage, origin: str, welcome: bool
) -> None:
    async def come() -> int:
        try:
            async with visit(stage.url, origin=Origin(origin)):
                return 101
        except InvalidStatus as refused:
            return refused.response.status_code

    assert stage.during(come(), patches=2) == (101 if welcome else 403)


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
    assert f"silent user is '{name}'; expected a sample within 2 s" in reason
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
    """Its patches wait where newer ones replace them; its news pile up until it is closed."""
    slow = next(names)

    async def stall() -> tuple[int, str, list[int]]:
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
            for _ in range(MAX_EVENTS // 2 + 1):
                async with visit(stage.url) as other:
                    await other.join(next(names))
                    await says_bye(other)
            assert at_server.session.close is not None
            client.ws.transport.resume_reading()
            code, reason, patches = await client.end()
            return code, reason, [patch.tick for patch in patches]

    code, reason, ticks = stage.during(stall(), patches=100)
    assert code == CloseCode.TOO_SLOW.value
    assert f"{MAX_EVENTS} events wait" in reason
    # Fewer, and never older.
    assert ticks == sorted(set(ticks))


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


def test_an_address_that_cannot_be_had_is_refused_with_a_way_out(small_balloon: Balloon) -> None:
    """192.0.2.1 is kept for documentation (RFC 5737): no machine has it."""

    async def start(host: str, port: int) -> None:
        await CohapticServer(small_balloon, ServerSettings(host=host, port=port)).start()

    with pytest.raises(SettingError, match=r"address is 192\.0\.2\.1:0 .*; it must be one of this"):
        asyncio.run(start("192.0.2.1", 0))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(SettingError, match=f"port is {port}, which is in use on 127.0.0.1"):
            asyncio.run(start("127.0.0.1", port))


def test_who_asks_for_mesh_patches_gets_the_rest_mesh_before_them(stage: Stage) -> None:
    async def happening() -> tuple[RestMesh, list[Patch]]:
        async with visit(stage.url) as client:
            asked = hello("mesh").model_copy(update={"geometry": "mesh"})
            await client.ws.send(encode_control(asked))
            assert isinstance(await client.hear(), Welcome)
            frame = await client.ws.recv(decode=False)
            return RestMesh.decode(frame), await client.play(3)

    mesh, patches = stage.during(happening())
    assert len(mesh.vertices) == len(stage.server.room.body.mesh.vertices)
    for patch in patches:
        assert patch.geometry is Geometry.MESH
        assert patch.neighbourhood is not None
        assert max(patch.neighbourhood.indices, default=0) < len(mesh.vertices)


def test_a_law_is_changed_on_the_wire_and_the_patches_say_so(stage: Stage) -> None:
    async def change() -> list[Patch]:
        async with visit(stage.url) as client:
            await client.join(next(names))
            before = await client.play(2)
            await client.ws.send(encode_control(SetLaw(law=Law.PI)))
            after = await client.play(30)
            await client.ws.send(encode_control(Bye()))
            return before + after

    patches = stage.during(change())
    laws = [patch.law for patch in patches]
    assert laws[0] is Law.PREDICTIVE
    assert laws[-1] is Law.PI
    assert laws == sorted(laws, key=lambda law: law is Law.PI)
    assert patches[-1].integral_gain > 0.0
    assert patches[-1].k_h < patches[0].k_h


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
