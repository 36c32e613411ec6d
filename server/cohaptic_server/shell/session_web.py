"""Serves a recorded session to pages: files of the page, scenes, ledgers, Green's functions.

Nothing is simulated, and nobody can join. The file is read in a thread of its own, one question at
a time, so that the number of open files and the memory stay bounded.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TypeVar

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from cohaptic.errors import SettingError
from cohaptic.sessions.replay import Replay
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.green import green_source, model_name
from cohaptic_server.http.routes import (
    Answer,
    BlocksNeeded,
    Request,
    Site,
    green_blocks,
    load_page,
    text,
)
from cohaptic_server.http.session_routes import (
    ScenesAsked,
    WhyAsked,
    answer,
    bad,
    scenes_answer,
    why_answer,
)
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.http import (
    BLOCK_PATIENCE,
    DOWNLOAD_TIMEOUT,
    GreenBlocks,
    HostCheck,
    counted,
    plain,
    response,
    solver,
    too_many,
)
from cohaptic_server.shell.limiter import ConnectionLimiter
from cohaptic_server.shell.listener import Listener, listen
from cohaptic_server.shell.wire import Wire

_MAX_WAITING = 16  # questions for the file; a page asks some two at a time
T = TypeVar("T")


class SessionWeb:
    """HTTP service of one recorded session.

    Args:
        replay: The session.
        body: Body whose Green's functions are served; None without any.
        unshown: Sentence that says why there are none; empty if there are, or none are needed.
        settings: Settings with host and port.
        limiter: Limiter with the rate limits and the clock of the server.
    """

    def __init__(
        self,
        replay: Replay,
        body: Body | None,
        unshown: str,
        settings: ServerSettings,
        limiter: ConnectionLimiter,
    ) -> None:
        source = None if body is None else green_source(body)
        model = None if source is None else model_name(source)
        vertices = 0 if source is None else len(source.mesh.vertices)
        self._replay, self._settings, self._limiter = replay, settings, limiter
        self._overview = replay.overview(model, unshown)
        self._blocks = None if source is None else GreenBlocks(solver(source))
        self._site = Site(load_page(), model, vertices)
        self._check = HostCheck(settings)
        self._thread = ThreadPoolExecutor(1, "session")
        self._waiting = 0

    async def listen(self) -> tuple[Listener, str]:
        """Open the port; return the listener and its URL, `ws://HOST:PORT`.

        Raises:
            SettingError: The address or port is not available.
        """
        return await listen(_nobody, self.process, self._settings, self._limiter)

    async def process(self, connection: ServerConnection, request: HttpRequest) -> Response:
        """Return the response to a request; one for a websocket is refused."""
        asked = plain(request)
        assert isinstance(connection, Wire)
        refusal = connection.come_from(request.headers)
        if refusal is not None:
            return response(too_many(asked, refusal))
        refused = self._check(connection, request)
        if refused is not None:
            self._limiter.traffic.refused["origin or host"] += 1
            return refused
        if "Upgrade" in request.headers:
            message = "this is a recorded session: nobody can touch it, and no room is here\n"
            return response(text(asked, 404, "Not Found", message))
        # Time that the library waits for the peer to take the whole response.
        connection.close_timeout = DOWNLOAD_TIMEOUT
        return counted(self._limiter, connection, asked, await self._answer(asked))

    async def _answer(self, request: Request) -> Answer:
        try:
            match answer(request, self._overview, self._replay.mesh):
                case Answer() as known:
                    return known
                case ScenesAsked(start, end):
                    scenes = await self._read(partial(self._replay.scenes, start, end))
                    return busy(request) if scenes is None else scenes_answer(request, scenes)
                case WhyAsked(user, t):
                    found = await self._read(lambda: (self._replay.why(user, t),))
                    return busy(request) if found is None else why_answer(request, *found)
                case None:
                    pass
        except SettingError as error:
            return bad(request, str(error))
        of_page = self._site.answer(request, ticking=True)
        if isinstance(of_page, BlocksNeeded):
            assert self._blocks is not None
            blocks = await self._blocks.blocks(of_page.vertices, BLOCK_PATIENCE)
            return green_blocks(request, blocks)
        return of_page

    async def _read(self, read: Callable[[], T]) -> T | None:
        """Return what a function reads of the file; None if too many wait for it already."""
        if self._waiting >= _MAX_WAITING:
            return None
        self._waiting += 1
        try:
            return await asyncio.get_running_loop().run_in_executor(self._thread, read)
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """Cancel what waits for the file or for Green's functions."""
        self._thread.shutdown(wait=False, cancel_futures=True)
        if self._blocks is not None:
            self._blocks.close()


def busy(request: Request) -> Answer:
    """Make the response to a question for which the file has no time now."""
    message = "too many ask for the file at once; ask again\n"
    return text(request, 503, "Service Unavailable", message, ("Retry-After", "1"))


async def _nobody(_: Wire) -> None:
    """Serve no websocket: each request for one is refused."""
