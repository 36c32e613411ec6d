"""`cohaptic admin` at a real server, over TLS and without."""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from cohaptic.clock import SystemClock
from cohaptic.errors import SettingError
from cohaptic.protocol.messages import encode_control
from cohaptic_client.admin import admin
from cohaptic_client.network.conversation import Refused
from cohaptic_server.access.admission import Admission
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.credentials.certificate import Certificate
from cohaptic_server.shell.limiter import Protection
from tests.patience import PATIENCE
from tests.server.access.some import ALL, RING, token
from tests.server.credentials.pairs import write_authority, write_pair
from tests.server.peers import hello
from tests.server.shell.stage import Client, Served, serving, visit

pytestmark = pytest.mark.live


@pytest.fixture(scope="module")
def balloon() -> Balloon:
    return Balloon(BalloonSettings(subdivisions=2, contact_radius=0.03))


def now() -> float:
    clock = SystemClock()
    return clock.now() + clock.to_wall()


def invitation(name: str, *, room_admin: bool = False) -> str:
    grants = ALL.model_copy(update={"room_admin": room_admin})
    return token(grants, jti=name, iat=now(), exp=now() + 600.0)


def run(*arguments: str) -> str:
    app = typer.Typer()
    app.command()(admin)
    result = CliRunner().invoke(app, list(arguments))
    if isinstance(result.exception, Exception):
        raise result.exception
    return result.stdout.strip()  # standard error has the log of the server beside it


async def come(client: Client, name: str, secret: str) -> None:
    message = hello(name).model_copy(update={"token": secret})
    await client.ws.send(encode_control(message))
    await client.hear()


def beside(
    balloon: Balloon, protection: Protection, check: Callable[[Served], Any], **more: Any
) -> None:
    async def go() -> None:
        async with serving(balloon, protection=protection, **more) as served:
            await check(served)

    asyncio.run(go())


def test_who_is_kicked_is_told_and_comes_back_refused(balloon: Balloon, tmp_path: Path) -> None:
    ca = str(write_authority(tmp_path))
    certificate = Certificate(*write_pair(tmp_path))
    protection = Protection(Admission(RING, admits_anybody=False), certificate)
    owner, secret = invitation("owner", room_admin=True), invitation("guest")

    async def check(served: Served) -> None:
        trust = ssl.create_default_context(cafile=ca)
        there = ("--token", owner, "--ca-file", ca)
        assert await asyncio.to_thread(run, served.url, *there) == "nobody touches"
        async with visit(served.url, ssl=trust) as client:
            await come(client, "villain", secret)
            listed = await asyncio.to_thread(run, served.url, "list", *there)
            assert listed.endswith("villain")
            with pytest.raises(SettingError, match="one of: 1 villain"):
                await asyncio.to_thread(run, served.url, "kick", "nobody", *there)
            done = await asyncio.to_thread(run, served.url, "kick", "villain", *there)
            assert done == "done: kick villain"
            code, reason, _ = await client.end()
            assert (code, reason) == (
                4403,
                "you were put out of this room: ask the owner of the room for a new invitation",
            )
        async with visit(served.url, ssl=trust) as client:
            await come(client, "villain", secret)
            assert (await client.end())[0] == 4403
        assert await asyncio.to_thread(run, served.url, "freeze", *there) == "done: freeze"
        assert served.server.room.frozen
        budget = ("force-budget", "--force", "20")
        await asyncio.to_thread(run, served.url, *budget, *there)
        assert served.server.room.force_budget == 20.0

    beside(balloon, protection, check)


def test_a_number_is_a_users_and_not_the_name_of_another(balloon: Balloon) -> None:
    protection = Protection(Admission(RING, admits_anybody=False))
    there = ("--token", invitation("owner", room_admin=True))

    async def check(served: Served) -> None:
        async with visit(served.url) as first, visit(served.url) as second:
            await come(first, "2", invitation("first"))
            await come(second, "bob", invitation("second"))
            done = await asyncio.to_thread(run, served.url, "kick", "2", *there)
            assert done == "done: kick bob"
            assert (await second.end())[0] == 4403
            members = served.server.room.members
            async with asyncio.timeout(PATIENCE):  # the end is told first
                while len(members) > 1:
                    await asyncio.sleep(0.01)
            assert [m.hello.name for m in members.values()] == ["2"]

    beside(balloon, protection, check)


def test_who_may_not_is_refused(balloon: Balloon) -> None:
    protection = Protection(Admission(RING, admits_anybody=False))

    async def check(served: Served) -> None:
        with pytest.raises(Refused, match="without a token"):
            await asyncio.to_thread(run, served.url)
        guest = ("--token", invitation("guest"))
        assert await asyncio.to_thread(run, served.url, "list", *guest) == "nobody touches"
        with pytest.raises(Refused, match="roomAdmin"):
            await asyncio.to_thread(run, served.url, "freeze", *guest)
        assert not served.server.room.frozen

    beside(balloon, protection, check)


@pytest.mark.parametrize(
    "arguments", [("kick",), ("freeze", "ann"), ("freeze", "--force", "1"), ("list", "ann")]
)
def test_what_does_not_fit_together_is_a_sentence(arguments: tuple[str, ...]) -> None:
    with pytest.raises(SettingError):
        run("ws://127.0.0.1:1", *arguments)


def test_an_administrator_records_and_is_told_what_came_of_it(
    balloon: Balloon, tmp_path: Path
) -> None:
    protection = Protection(Admission(RING, admits_anybody=False))
    there = ("--token", invitation("owner", room_admin=True))

    async def check(served: Served) -> None:
        async def do(action: str) -> str:
            return await asyncio.to_thread(run, served.url, action, *there)

        assert await do("end-recording") == "nothing is recorded"
        assert await do("record") == "done: record"
        assert served.server.room.record is not None
        assert (await do("record")).startswith("it is recorded already")
        assert await do("end-recording") == "done: end-recording"
        assert served.server.room.record is None

    beside(balloon, protection, check, recordings=str(tmp_path / "kept"))
    assert len(list((tmp_path / "kept").iterdir())) == 1


def test_an_action_that_is_none_is_an_error() -> None:
    with pytest.raises(SettingError, match="one of list, mute"):
        run("ws://127.0.0.1:1", "dance")
