"""A room that a script serves: for `with` in a thread of its own, for `async with` on its loop."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from concurrent.futures import Future
from dataclasses import replace
from types import TracebackType
from typing import Any, NamedTuple, Self

from threadpoolctl import threadpool_limits

from cohaptic.vec import ZERO, Vec3
from cohaptic_server.bodies.body import Body
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.room.room import Room
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.exchange import ServedBody
from cohaptic_server.shell.limiter import Protection
from cohaptic_server.shell.server import CohapticServer

_MOST_FRAMES = 8  # origins that a script may add: a notebook has one


class RoomHand(NamedTuple):
    """A user of a room, as the newest sample of its client says.

    Fields:
        user: Number of the user.
        name: Name of the user.
        tip: Position of its tip, shape (3,) [m]; None before the first sample.
        force: Force on its hand, shape (3,) [N]; the body gets the opposite one.
    """

    user: int
    name: str
    tip: Vec3 | None
    force: Vec3


class ServedRoom:
    """A room with one body, which is served while a block of a script runs.

    [`serve`][cohaptic_server.serve] makes it. With `with` the server runs in a thread of its own,
    also in a notebook; with `async with` it runs on the event loop of the block. Meanwhile matrix
    products of the whole process take one thread each, since several would hold up the ticks.

    Args:
        body: Body, or the name or file of one as after `cohaptic serve --body`.
        settings: Settings of the server.
        protection: Access control, encryption and trusted proxies; None admits anybody.
    """

    def __init__(
        self, body: Body | str, settings: ServerSettings, protection: Protection | None = None
    ) -> None:
        made = {"body": body} if isinstance(body, str) else {"class": _name_of(body)}
        self.settings = replace(settings, made_from=made)
        self._protection = protection
        hz = settings.simulation_hz
        self._body = build_body(body, hz=hz) if isinstance(body, str) else body
        self._server: CohapticServer | None = None
        self._url = ""
        self._going: asyncio.Task[None] | None = None
        self._thread: threading.Thread | None = None
        self._ended: Future[None] = Future()
        self._framing = threading.Lock()
        self._given_frames = len(settings.allow_frames)
        self._stop: tuple[asyncio.AbstractEventLoop, asyncio.Event] | None = None

    @property
    def url(self) -> str:
        """Address for clients, such as `ws://127.0.0.1:8765`; empty before the block."""
        return self._url

    @property
    def page(self) -> str:
        """Address of the page for browsers; empty before the block."""
        return f"http{self._url.removeprefix('ws')}/" if self._url else ""

    @property
    def room(self) -> Room:
        """The room itself. Only code on the server's event loop may change it."""
        if self._server is None:
            raise RuntimeError("a room is there inside its block: with serve(...) as room")
        return self._server.room

    @property
    def users(self) -> tuple[RoomHand, ...]:
        """The users of the room, in the order in which they came."""
        found = list[RoomHand]()
        for member in list(self.room.members.values()):
            touch = member.touch
            tip, force = (None, ZERO) if touch is None else (touch.probe, touch.force)
            found.append(RoomHand(member.user, member.hello.name, tip, force))
        return tuple(found)

    @property
    def ticks(self) -> int:
        """Number of ticks since the body was made."""
        return self.room.world.tick

    def allow_frame(self, origin: str) -> None:
        """Let pages of an origin show the page of this room in a frame, as `--allow-frame`.

        [`cohaptic.view`][cohaptic.view] calls it for the notebook in which it shows the room. Of
        the origins that it has named, the newest eight count.

        Args:
            origin: A scheme, a host and a port if it has one, such as `http://localhost:8888`.

        Raises:
            SettingError: This is no origin that may show the page.
        """
        with self._framing:
            frames = self.settings.allow_frames
            if origin in frames:
                return
            given, added = frames[: self._given_frames], frames[self._given_frames :]
            frames = (*given, *(*added, origin)[-_MOST_FRAMES:])
            self.settings = replace(self.settings, allow_frames=frames)  # which checks the origin
            if self._server is not None:
                self._server.web.allow_frames(frames)

    def wait(self, seconds: float | None = None) -> bool:
        """Let the room be touched; return whether it is still served.

        Of a room that runs in a thread: a script that does nothing else calls this at the end of
        its block, and Ctrl-C ends it.

        Args:
            seconds: Time to wait [s]; None to wait for as long as the room is served.
        """
        if self._thread is None:
            raise RuntimeError("a room on an event loop is not waited for: await something else")
        try:
            self._thread.join(seconds)
        except KeyboardInterrupt:
            return False
        return self._thread.is_alive()

    async def __aenter__(self) -> Self:
        started: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._going = asyncio.ensure_future(self._serve(started))
        await asyncio.wait((self._going, started), return_when=asyncio.FIRST_COMPLETED)
        if self._going.done():
            self._going.result()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self._going is not None
        self._going.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._going

    def __enter__(self) -> Self:
        ready: Future[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = Future()
        self._ended = Future()

        async def host() -> None:
            end = asyncio.Event()
            async with self:
                ready.set_result((asyncio.get_running_loop(), end))
                assert self._going is not None
                ending = asyncio.ensure_future(end.wait())
                first = asyncio.FIRST_COMPLETED
                await asyncio.wait((ending, self._going), return_when=first)

        def work() -> None:
            try:
                asyncio.run(host())
            except BaseException as error:  # for the script's own thread
                (self._ended if ready.done() else ready).set_exception(error)
            else:
                self._ended.set_result(None)

        self._thread = threading.Thread(target=work, name="cohaptic server", daemon=True)
        self._thread.start()
        self._stop = ready.result()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self._stop is not None
        assert self._thread is not None
        loop, end = self._stop
        with contextlib.suppress(RuntimeError):  # the server has ended with an error
            loop.call_soon_threadsafe(end.set)
        self._thread.join()
        self._ended.result()

    async def _serve(self, started: asyncio.Future[None]) -> None:
        served = ServedBody(self._body)
        with contextlib.ExitStack() as stack:
            stack.callback(served.stop)
            served.start()
            server = CohapticServer(self._body, self.settings, served.solve, self._protection)
            self._url = await server.start()
            self._server = server
            started.set_result(None)
            # The matrix products of a tick are small: several threads would wait for the slowest.
            stack.enter_context(threadpool_limits(limits=1))
            await server.run(served.pump)


def _name_of(body: Body) -> str:
    return f"{type(body).__module__}:{type(body).__qualname__}"


def serve(
    body: Body | str = "balloon",
    *,
    port: int = 8765,
    protection: Protection | None = None,
    **settings: Any,
) -> ServedRoom:
    """Serve a body from a script: `with serve(MyBody(), port=8765) as room:`.

    Inside the block people touch it, at `room.url` with a client and at `room.page` in a browser.
    The server shares the interpreter with the script, which makes ticks late while it computes for
    long: a server that others rely on runs in a process of its own, as step 1 of the examples.

    A server keeps real time; for steps of your own, without any network, use
    [`VirtualSession`][cohaptic_experiments.VirtualSession].

    Args:
        body: Body, or the name or file of one as after `cohaptic serve --body`.
        port: TCP port; 0 lets the system choose.
        protection: Access control, encryption and trusted proxies; None admits anybody.
        settings: Other fields of [`ServerSettings`][cohaptic_server.ServerSettings].

    Raises:
        SettingError: A setting is outside its limits, or the port is taken; the latter when the
            block begins.
    """
    return ServedRoom(body, ServerSettings(port=port, **settings), protection)
