"""Clients that violate the protocol or cannot come in, on real sockets; nobody else notices."""

from __future__ import annotations

import asyncio
import struct

import pytest
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin

from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import (
    Bye,
    Error,
    ServerControl,
    encode_control,
)
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.shell.wire import MAX_INBOUND_BYTES
from tests.server.peers import hello_text, sample, text
from tests.server.shell.stage import Stage, names, serving, visit

pytestmark = pytest.mark.live


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
            "message is 'Hello'; expected ContactSample or SetName or SetLaw or Mark or Bye",
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
    reported = [message for message in news if isinstance(message, Error)]
    if code == 1009:
        # The websocket's own limit: the frame was never read, so the close alone says it.
        assert reported == []
        assert words in reason
    else:
        assert [error.code for error in reported] == [code]
        assert words in reported[0].message
        assert reported[0].message.startswith(reason)
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
            "another one: steady is taken",
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
            "message is 'Bye'; expected Hello or Watch: has not said hello",
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
        "number of users is 2; expected at most 1; you can watch on the page meanwhile, or"
        " wait for a place",
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


def test_who_asks_for_another_room_is_told_that_it_is_not_here(stage: Stage) -> None:
    async def other() -> tuple[int, str]:
        async with visit(f"{stage.url}/r/other") as client:
            return (await client.end())[:2]

    async def own() -> int:
        async with visit(f"{stage.url}/r/main/") as client:
            return await client.join("by_name")

    code, reason = stage.runner.run(other())
    assert (code, reason) == (CloseCode.NO_ROOM.value, "there is no room other here")
    assert stage.runner.run(own()) > 0
