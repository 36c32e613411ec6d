"""`deploy/nginx.conf`, played: TLS by nginx, addresses by its word, and by nobody else's."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from cohaptic.clock import SystemClock
from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import Welcome, encode_control
from cohaptic_server.access.admission import Admission
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.shell.limiter import Protection
from tests.server.access.some import RING, token
from tests.server.credentials.pairs import write_authority
from tests.server.peers import hello
from tests.server.shell.nginx import AS_IN_THE_FILE, NEEDS_NGINX, proxied
from tests.server.shell.stage import serving, visit

pytestmark = [pytest.mark.live, NEEDS_NGINX]


def invitation() -> str:
    clock = SystemClock()
    now = clock.now() + clock.to_wall()
    return token(iat=now, exp=now + 600.0)


BEHIND = Protection(Admission(RING, admits_anybody=False), proxies=("127.0.0.1",))


def test_who_comes_through_the_proxy_touches_and_no_log_has_the_token(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    secret = invitation()

    async def run() -> None:
        trust = ssl.create_default_context(cafile=str(write_authority(tmp_path)))
        async with (
            serving(small_balloon, protection=BEHIND, allow_hosts=("lab.example",)) as served,
        ):
            with proxied(served.url, tmp_path) as port:
                url = f"wss://lab.example:{port}/"
                there: dict[str, Any] = {"ssl": trust, "host": "127.0.0.1", "port": port}
                async with visit(url, origin=f"https://lab.example:{port}", **there) as client:
                    message = hello("left").model_copy(update={"token": secret})
                    await client.ws.send(encode_control(message))
                    assert isinstance(await client.hear(), Welcome)
                    assert len(await client.play(20)) == 20
                with pytest.raises(InvalidStatus):
                    async with visit(url, origin="https://evil.example", **there):
                        pass
                reader, writer = await asyncio.open_connection(
                    "127.0.0.1", port, ssl=trust, server_hostname="lab.example"
                )
                head = f"GET /healthz HTTP/1.1\r\nHost: lab.example:{port}\r\n"
                writer.write(f"{head}Connection: close\r\n\r\n".encode())
                assert (await reader.read()).startswith(b"HTTP/1.1 200")
                writer.close()

    asyncio.run(run())
    logs = "".join(path.read_text() for path in tmp_path.glob("*.log"))
    assert "GET /" in logs
    assert secret[:20] not in logs
    assert secret.split(".")[1][:20] not in logs


APPENDS, DROPS = "proxy_set_header X-Forwarded-For", 'proxy_set_header Forwarded "";'
WAYS = {
    "as in the file": AS_IN_THE_FILE,
    "with ports": f'{DROPS} {APPENDS} "$proxy_add_x_forwarded_for:$remote_port";',
    "in quotes": f'{DROPS} {APPENDS} "$http_x_forwarded_for, \\"$remote_addr:$remote_port\\"";',
    "by Forwarded": f'{APPENDS} ""; proxy_set_header Forwarded "$http_forwarded, '
    'for=\\"$remote_addr:$remote_port\\";proto=https";',
}


@pytest.mark.parametrize("tells", WAYS.values(), ids=WAYS)
def test_budgets_are_those_of_who_comes_and_not_of_the_proxy(
    small_balloon: Balloon, tmp_path: Path, tells: str
) -> None:
    """nginx comes from one address, and who connects to it from 127.0.0.2 and 127.0.0.3."""
    few = Limits(joins=Budget(0.001, 2.0))
    behind = Protection(Admission(RING, admits_anybody=False), proxies=("127.0.0.0/31",))

    async def run() -> None:
        trust = ssl.create_default_context(cafile=str(write_authority(tmp_path)))
        async with (
            serving(
                small_balloon, protection=behind, allow_hosts=("lab.example",), limits=few
            ) as served,
        ):
            with proxied(served.url, tmp_path, (AS_IN_THE_FILE, tells)) as port:

                async def code(source: str, said: str = "") -> int:
                    """How a first message without a token ends, from this address."""
                    more = {"X-Forwarded-For": said, "Forwarded": f'for="{said}"'} if said else None
                    async with visit(
                        f"wss://lab.example:{port}/", ssl=trust, host="127.0.0.1", port=port,
                        local_addr=(source, 0), additional_headers=more,
                    ) as client:  # fmt: skip
                        await client.ws.send(encode_control(hello()))
                        with contextlib.suppress(ConnectionClosed):
                            while True:
                                await client.ws.recv()
                        assert client.ws.close_code is not None
                        return client.ws.close_code

                wrong, many = CloseCode.UNAUTHENTICATED.value, CloseCode.TOO_MANY.value
                assert [await code("127.0.0.2") for _ in range(3)] == [wrong, wrong, many]
                # Whatever it says, it is who it is.
                assert await code("127.0.0.2", "9.9.9.9") == many
                assert await code("127.0.0.2", "127.0.0.3, 127.0.0.1") == many
                assert await code("127.0.0.3") == wrong
                assert await code("127.0.0.2", '9.9.9.9";for=9.9.9.8;x="') == many
                assert served.server.limiter.sources.open <= 2

    asyncio.run(run())


def test_who_writes_the_list_that_its_proxy_passes_on_is_refused(
    small_balloon: Balloon, tmp_path: Path
) -> None:
    """One that sets X-Forwarded-For and leaves Forwarded as it comes, which is most of them."""

    async def run() -> None:
        trust = ssl.create_default_context(cafile=str(write_authority(tmp_path)))
        async with (
            serving(small_balloon, protection=BEHIND, allow_hosts=("lab.example",)) as served,
        ):
            with proxied(
                served.url, tmp_path, (AS_IN_THE_FILE, f"{APPENDS} $remote_addr;")
            ) as port:

                async def answer(forwarded: str) -> bytes:
                    reader, writer = await asyncio.open_connection(
                        "127.0.0.1", port, ssl=trust, server_hostname="lab.example",
                        local_addr=("127.0.0.2", 0),
                    )  # fmt: skip
                    head = f"GET /healthz HTTP/1.1\r\nHost: lab.example:{port}\r\n"
                    head += f"Forwarded: {forwarded}\r\nConnection: close\r\n\r\n"
                    writer.write(head.encode())
                    whole = await reader.read()
                    writer.close()
                    return whole

                assert (await answer("for=127.0.0.2;proto=https")).startswith(b"HTTP/1.1 200")
                refused = await answer("for=9.9.9.9")
                assert refused.startswith(b"HTTP/1.1 400")
                assert b"name two addresses: 127.0.0.2 and 9.9.9.9" in refused

    asyncio.run(run())
