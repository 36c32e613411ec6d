"""Routes of a server: checked before the object is built, opened together, ended together."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncGenerator
from contextlib import AbstractAsyncContextManager

import pytest

from cohaptic.errors import SettingError
from cohaptic.extensions import ExtensionError
from cohaptic_server import routes
from cohaptic_server.bodies.spring import Spring
from cohaptic_server.routes import Route, Serving, loaded, opened
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.server import CohapticServer
from cohaptic_uploads.upload_desk import take_uploads


def serving() -> Serving:
    body = Spring()
    return Serving(CohapticServer(body, ServerSettings(port=0)), ServedBody(body))


def notes(into: list[str], name: str, line: str = "") -> Route:
    """A route that notes when it opens and ends."""

    @contextlib.asynccontextmanager
    async def run() -> AsyncGenerator[str]:
        into.append(f"{name} opens")
        try:
            yield line
        finally:
            into.append(f"{name} ends")

    def begin(_serving: Serving, _text: str) -> AbstractAsyncContextManager[str]:
        return run()

    return Route(begin)


def fails(_serving: Serving, _text: str) -> AbstractAsyncContextManager[str]:
    raise SettingError("port", 80, "one of your own")


@contextlib.asynccontextmanager
async def hangs(_serving: Serving, _text: str) -> AsyncGenerator[str]:
    """It does not end, and swallows the first attempt to cancel it."""
    yield ""
    with contextlib.suppress(asyncio.CancelledError):
        await asyncio.Event().wait()
    await asyncio.Event().wait()


def test_routes_that_do_not_end_do_not_keep_the_server(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(routes, "ENDING", 0.01)

    async def run() -> None:
        both = {"one": Route(hangs), "other": Route(hangs)}
        async with opened(both, {"one": "", "other": ""}, serving()):
            pass

    asyncio.run(run())
    assert "the route one has not ended within 0.01 s" in caplog.text
    assert "the route other has not ended within 0.01 s" in caplog.text


def test_a_fault_of_a_route_ends_neither_the_server_nor_another_route(
    caplog: pytest.LogCaptureFixture,
) -> None:
    noted: list[str] = []

    @contextlib.asynccontextmanager
    async def breaks(_serving: Serving, _text: str) -> AsyncGenerator[str]:
        async with asyncio.TaskGroup() as group:
            yield ""
            group.create_task(fail())

    async def fail() -> None:
        raise RuntimeError("at its end")

    async def run() -> None:
        both = {"broken": Route(breaks), "a": notes(noted, "a")}
        async with opened(both, {"broken": "", "a": ""}, serving()):
            task = asyncio.current_task()
            assert task is not None
            task.cancel()
            await asyncio.sleep(1.0)

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(run())
    assert noted == ["a opens", "a ends"]
    assert "the route broken has failed: ExceptionGroup" in caplog.text


def test_a_route_that_does_not_open_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(routes, "OPENING", 0.01)

    @contextlib.asynccontextmanager
    async def waits(_serving: Serving, _text: str) -> AsyncGenerator[str]:
        await asyncio.Event().wait()
        yield ""

    async def run() -> None:
        async with opened({"slow": Route(waits)}, {"slow": ""}, serving()):
            pytest.fail("it was open")

    monkeypatch.setattr(routes, "ENDING", 0.01)
    with pytest.raises(SettingError, match="route is slow; it must be opened within"):
        asyncio.run(run())


def test_without_a_check_no_text_can_be_used() -> None:
    with pytest.raises(SettingError, match="it takes none"):
        Route(fails).check("9100")
    Route(fails).check("")


def test_whatever_the_code_of_another_package_raises_names_the_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def check(_text: str) -> None:
        raise ZeroDivisionError("oh")

    def adder(_group: str, _name: str) -> str:
        return "their-package"

    def load(*_: object) -> Route:
        return Route(fails, check)

    monkeypatch.setattr(routes, "adder", adder)
    monkeypatch.setattr(routes, "load", load)
    with pytest.raises(ExtensionError, match=r"their-package adds.*ZeroDivisionError: oh"):
        loaded({"theirs": ""})


def test_files_are_taken_only_where_pages_are_told_so() -> None:
    with pytest.raises(SettingError, match="allow_upload is False"):
        take_uploads(serving())
