"""Who comes into rooms, over real sockets: tokens, their keys, and a proxy's word."""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
from collections.abc import AsyncGenerator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from cohaptic.clock import SystemClock
from cohaptic.errors import CloseCode
from cohaptic.protocol.messages import Error, Welcome, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import Moderate, Watch
from cohaptic_ops.rooms.config import RoomsConfig, RoomTable
from cohaptic_ops.rooms.rooms_server import RoomsServer
from cohaptic_ops.rooms.tables import AccessTable
from cohaptic_ops.rooms_cli import protect
from cohaptic_server.access.keys import Grants, Key, KeyRing, write_keys
from cohaptic_server.credentials.key_file import save_keys
from tests.ops.rooms.bodies import small
from tests.patience import PATIENCE
from tests.server.access.some import ALL, KEY, OTHER, RING, token
from tests.server.peers import hello
from tests.server.shell.stage import names, visit

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(sys.platform == "win32", reason="hands sockets over"),
]


@contextlib.asynccontextmanager
async def served(access: AccessTable, *rooms: str, **more: Any) -> AsyncGenerator[RoomsServer]:
    tables = {name: RoomTable(body="balloon") for name in rooms}
    config = RoomsConfig(port=0, rooms=tables, access=access, **more)
    builds = dict.fromkeys(rooms, small)
    rooms_server = RoomsServer(config, builds, protect=partial(protect, access, "127.0.0.1"))
    try:
        async with asyncio.timeout(PATIENCE):
            yield rooms_server
    finally:
        await rooms_server.drain()


async def comes(url: str, secret: str | None) -> Welcome | int:
    """The welcome of one with a token, or the code of its refusal."""
    async with visit(url) as client:
        message = hello(next(names)).model_copy(update={"token": secret})
        await client.ws.send(encode_control(message))
        answer = await client.hear()
        if isinstance(answer, Welcome):
            return answer
        assert isinstance(answer, Error)
        return answer.code


def invitation(room: str) -> str:
    clock = SystemClock()
    now = clock.now() + clock.to_wall()
    grants: Grants = ALL.model_copy(update={"room": room})
    return token(grants, jti=f"for {room}".replace(" ", "-"), iat=now, exp=now + 600.0)


def test_a_token_is_for_its_room_and_its_session_for_what_it_is_for(tmp_path: Path) -> None:
    save_keys(tmp_path / "keys", RING, replace=False)

    async def go() -> None:
        access = AccessTable(keys=tmp_path / "keys", single_use=True)
        async with served(access, "lab-1", "lab-2", "other") as rooms_server:
            url = await rooms_server.start()
            one, two, other = (f"{url}/r/{room}" for room in ("lab-1", "lab-2", "other"))
            first = await comes(one, invitation("lab-1"))
            assert isinstance(first, Welcome)
            for room in (two, other):
                assert await comes(room, invitation("lab-1")) == CloseCode.FORBIDDEN.value
                # What brings somebody back brings nobody into another room.
                assert await comes(room, first.session) == CloseCode.FORBIDDEN.value
            assert isinstance(await comes(one, first.session), Welcome)
            assert await comes(one, invitation("lab-1")) == CloseCode.UNAUTHENTICATED.value
            assert await comes(other, None) == CloseCode.UNAUTHENTICATED.value
            wide = await comes(one, invitation("lab-*"))
            assert isinstance(wide, Welcome)
            assert isinstance(await comes(two, wide.session), Welcome)
            assert await comes(other, wide.session) == CloseCode.FORBIDDEN.value

    asyncio.run(go())


def test_rooms_read_their_keys_again_when_they_are_asked_to(tmp_path: Path) -> None:
    path = tmp_path / "keys"
    save_keys(path, RING, replace=False)
    old = path.stat()

    async def go() -> None:
        async with served(AccessTable(keys=path), "a", "b") as rooms_server:
            url = await rooms_server.start()
            rooms = [f"{url}/r/{room}" for room in ("a", "b")]
            secret = invitation("*")
            for room in rooms:
                assert isinstance(await comes(room, secret), Welcome)
            # Nothing but the asking tells that it is another: as long, as old, in its place.
            path.write_text(write_keys(KeyRing((Key(KEY.kid, OTHER.secret),))))
            assert path.stat().st_size == old.st_size
            os.utime(path, ns=(old.st_atime_ns, old.st_mtime_ns))
            rooms_server.read_again()
            for room in rooms:
                while isinstance(await comes(room, secret), Welcome):
                    await asyncio.sleep(0.05)

    asyncio.run(go())


def test_bans_and_used_tokens_outlive_a_killed_room_and_a_server(tmp_path: Path) -> None:
    save_keys(tmp_path / "keys", RING, replace=False)
    access = AccessTable(keys=tmp_path / "keys", single_use=True, state=tmp_path / "state")
    admin: Grants = ALL.model_copy(update={"room": "main", "room_admin": True})
    clock = SystemClock()
    now = clock.now() + clock.to_wall()
    link = invitation("main")
    order = token(admin, jti="admin", iat=now, exp=now + 600.0)

    async def go() -> None:
        async with served(access, "main") as rooms_server:
            url = await rooms_server.start()
            async with visit(url) as guest:
                said = hello("guest").model_copy(update={"token": link})
                await guest.ws.send(encode_control(said))
                welcome = await guest.hear()
                assert isinstance(welcome, Welcome)
                async with visit(url) as watcher:
                    watch = Watch(protocol=PROTOCOL_VERSION, token=order)
                    await watcher.ws.send(encode_control(watch))
                    wish = Moderate(action="ban", user=welcome.user)
                    await watcher.ws.send(encode_control(wish))
                    assert (await guest.end())[0] == CloseCode.FORBIDDEN.value
            # No room waits for a disk: it writes a moment later what has to outlive it.
            while '"removed"' not in (tmp_path / "state" / "main.jsonl").read_text():
                await asyncio.sleep(0.02)
            supervisor = rooms_server.supervisors["main"]
            assert supervisor.process is not None
            before = supervisor.process
            before.kill()
            while supervisor.state != "open" or supervisor.process is before:
                await asyncio.sleep(0.02)
            await refused(url, welcome.session)
        async with served(access, "main") as rooms_server:
            await refused(await rooms_server.start(), welcome.session)

    async def refused(url: str, session: str | None) -> None:
        assert await comes(url, session) == CloseCode.FORBIDDEN.value
        for used in (link, order):
            assert await comes(url, used) == CloseCode.UNAUTHENTICATED.value

    asyncio.run(go())
