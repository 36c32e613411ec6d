"""A server that speaks TLS: who is served, who is told what is wrong, and what it costs."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
from collections.abc import AsyncGenerator, Callable
from pathlib import Path
from typing import Any

import pytest

from cohaptic.clock import SystemClock
from cohaptic.errors import ServerLost
from cohaptic.protocol.messages import Welcome
from cohaptic.runtime.transport import unsent_of
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic_client.network.link import Link
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.credentials.certificate import Certificate
from cohaptic_server.shell import acceptor, listener, wire
from cohaptic_server.shell.limiter import Protection, Turns
from tests.patience import PATIENCE
from tests.server.credentials.pairs import write_authority, write_pair
from tests.server.shell.stage import Served, serving, visit

pytestmark = pytest.mark.live


def protected(folder: Path) -> Protection:
    return Protection(certificate=Certificate(*write_pair(folder)))


def trusting(folder: Path) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=str(write_authority(folder)))


def address(served: Served) -> tuple[str, int]:
    host, _, port = served.url.rpartition("//")[2].rpartition(":")
    return host, int(port)


async def until(true: Any) -> None:
    async with asyncio.timeout(PATIENCE):
        while not true():
            await asyncio.sleep(0.005)


def test_who_trusts_the_certificate_touches_and_reads_the_page(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    async def run() -> None:
        async with serving(small_balloon, protection=protected(tmp_path)) as served:
            assert served.url.startswith("wss://127.0.0.1:")
            async with visit(served.url, ssl=trusting(tmp_path)) as client:
                await client.join("left")
                assert len(await client.play(5)) == 5
            reader, writer = await asyncio.open_connection(*address(served), ssl=trusting(tmp_path))
            writer.write(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert (await reader.read()).startswith(b"HTTP/1.1 200 OK")
            writer.close()

    asyncio.run(run())


def test_a_certificate_that_was_renewed_is_served_and_nobody_inside_notices(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    async def run() -> None:
        protection = protected(tmp_path)
        certificate = protection.certificate
        assert certificate is not None
        async with serving(small_balloon, protection=protection) as served:
            async with visit(served.url, ssl=trusting(tmp_path)) as client:
                await client.join("left")
                before = certificate.ends
                write_pair(tmp_path, days=3.0)
                certificate.load()
                assert certificate.ends != before
                assert len(await client.play(5)) == 5
                async with visit(served.url, ssl=trusting(tmp_path)) as other:
                    await other.join("right")
                    tls = other.ws.transport.get_extra_info("ssl_object")
                    assert tls.getpeercert()["notAfter"] == certificate.ends

    asyncio.run(run())


def test_connections_whose_handshake_fails_are_not_counted_for_ever(
    small_balloon: Balloon, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(listener.TLS_OPTIONS, "ssl_handshake_timeout", 1.0)
    monkeypatch.setattr(acceptor, "HEAD_TIMEOUT", 1.0)

    async def run() -> None:
        async with serving(small_balloon, protection=protected(tmp_path)) as served:
            sources = served.server.limiter.sources
            async with visit(served.url, ssl=trusting(tmp_path)) as client:
                await client.join("left")
                held: list[socket.socket] = []
                for said in (
                    b"GET / HTTP/1.1\r\n\r\n",
                    b"\x16\x03\x01\x02\x00",
                    b"",
                    b"\xff" * 500,
                ):
                    for _ in range(5):
                        one = socket.create_connection(address(served))
                        one.send(said)
                        held.append(one)
                for one in held[::2]:
                    one.close()
                await until(lambda: sources.open > 1)
                # Those that say nothing are cut by the time-out of the handshake.
                await until(lambda: sources.open == 1)
                assert list(served.server.limiter.taken) != []
                assert len(await client.play(5)) == 5
                for one in held:
                    one.close()
            await until(lambda: sources.open == 0)
            assert served.server.limiter.taken == {}

    asyncio.run(run())


def test_of_many_handshakes_at_once_a_few_go_on_before_others_have_their_turn() -> None:
    later: list[Callable[[], None]] = []
    turns = Turns(later.append)
    assert [turns.take() for _ in range(7)] == [True] * 4 + [False] * 3
    assert len(later) == 1
    later.pop()()
    assert [turns.take() for _ in range(5)] == [True] * 4 + [False]


def test_all_who_shake_hands_at_once_come_in_and_a_connection_keeps_little_memory(
    small_balloon: Balloon, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # However long this machine takes for all of them.
    monkeypatch.setitem(listener.TLS_OPTIONS, "ssl_handshake_timeout", PATIENCE)
    monkeypatch.setattr(acceptor, "HEAD_TIMEOUT", PATIENCE)
    monkeypatch.setattr(wire, "HEAD_TIMEOUT", PATIENCE)

    async def run() -> None:
        trust = trusting(tmp_path)
        async with serving(small_balloon, protection=protected(tmp_path)) as served:
            opened = await asyncio.gather(
                *(asyncio.open_connection(*address(served), ssl=trust) for _ in range(40))
            )
            await until(lambda: len(served.server.limiter.taken) == 40)
            await until(
                lambda: all(one.turns is None for one in served.server.limiter.taken.values())
            )
            for _, writer in opened:
                below: Any = getattr(writer.transport, "_ssl_protocol")  # noqa: B009
                assert len(below._ssl_buffer) <= listener.TLS_BUFFER
                writer.close()

    asyncio.run(run())


def test_what_the_transport_below_holds_back_counts_as_not_sent(tmp_path: Path) -> None:
    """Else a path that stalls would look clear, and old patches would pile up in the process."""

    async def run() -> None:
        context = Certificate(*write_pair(tmp_path)).context
        accepted: asyncio.Queue[asyncio.StreamWriter] = asyncio.Queue()
        server = await asyncio.start_server(
            lambda _, writer: accepted.put_nowait(writer), "127.0.0.1", 0, ssl=context
        )
        host, port = server.sockets[0].getsockname()
        _, mine = await asyncio.open_connection(host, port, ssl=trusting(tmp_path))
        theirs = await accepted.get()
        reading, written = mine.transport, theirs.transport
        assert isinstance(reading, asyncio.Transport)
        assert isinstance(written, asyncio.Transport)
        reading.pause_reading()
        unsent = unsent_of(written)
        assert unsent() == 0
        for _ in range(10_000):
            theirs.transport.write(bytes(1024))
            if unsent():
                break
        assert unsent() > 0
        assert theirs.transport.get_write_buffer_size() == 0  # as asyncio sees it
        for writer in (mine, theirs):
            writer.transport.abort()
        server.close()

    asyncio.run(run())


async def opened(url: str, ca_file: Path | str = "") -> None:
    link = Link(url, SystemClock(), LinkSettings(), LinkSettings(), str(ca_file))
    try:
        await link.open()
    finally:
        await link.close()


@contextlib.asynccontextmanager
async def any_server(context: ssl.SSLContext | None) -> AsyncGenerator[int]:
    """Something that listens, with any certificate or none."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            await reader.read(1)
            writer.write(b"HTTP/1.1 400 Bad Request\r\n\r\n")
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0, ssl=context)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()


@pytest.mark.parametrize(
    ("hosts", "days", "trusted", "words"),
    [
        (("lab.example",), 1.0, True, r"is not for 127\.0\.0\.1: .*"),
        (("127.0.0.1",), -1.0, True, r"has expired; its owner has to renew it"),
        (("127.0.0.1",), 1.0, False, r"is not trusted: .*; name its issuer: --ca-file"),
    ],
)
def test_a_certificate_that_is_wrong_is_told_as_that(
    hosts: tuple[str, ...], days: float, trusted: bool, words: str, tmp_path: Path
) -> None:
    cert, key = write_pair(tmp_path, *hosts, days=days)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(cert, key)
    ca = write_authority(tmp_path) if trusted else ""

    async def run() -> None:
        async with any_server(context) as port:
            with pytest.raises(ServerLost, match=f"the certificate of the server {words}"):
                await opened(f"wss://127.0.0.1:{port}", ca)

    asyncio.run(run())


def test_an_old_client_of_tls_is_refused_and_nobody_else_notices(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    async def run() -> None:
        async with serving(small_balloon, protection=protected(tmp_path)) as served:
            async with visit(served.url, ssl=trusting(tmp_path)) as client:
                await client.join("left")
                old = trusting(tmp_path)
                old.set_ciphers("DEFAULT:@SECLEVEL=0")
                with pytest.warns(DeprecationWarning, match="TLSv1"):
                    old.minimum_version = ssl.TLSVersion.TLSv1
                with pytest.warns(DeprecationWarning, match="TLSv1_1"):
                    old.maximum_version = ssl.TLSVersion.TLSv1_1
                with pytest.raises((ssl.SSLError, ConnectionError)):
                    await asyncio.open_connection(*address(served), ssl=old)
                assert len(await client.play(5)) == 5
                assert not any(isinstance(news, Welcome) for news in client.news[1:])

    asyncio.run(run())
