"""Answers the HTTP requests that the websocket library passes on.

Green's functions for pages are solved one at a time outside the tick, and cached. A solve on a
large solid takes longer than a tick, so a separate thread solves, or waits for the process that
solves (`column_worker.py`). Only the request waits for that thread; the tick does not.
"""

from __future__ import annotations

import asyncio
import json
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from cohaptic.errors import one_line
from cohaptic.protocol.upload_messages import SUBPROTOCOL as UPLOAD
from cohaptic.room_address import split_path
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.green import GreenSource, encode_block, green_source, model_name
from cohaptic_server.guard.sources import Refusal
from cohaptic_server.http.reachable import (
    PATH,
    hosts_for_others,
    is_of_this_machine,
    is_own_host,
    may_connect,
)
from cohaptic_server.http.routes import (
    Answer,
    BlocksNeeded,
    Request,
    Site,
    green_blocks,
    load_page,
    moved,
    page,
    query_without_token,
    text,
)
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.column_worker import Unsolved
from cohaptic_server.shell.endpoint import Endpoint
from cohaptic_server.shell.limiter import ConnectionLimiter
from cohaptic_server.shell.own_addresses import machine_addresses
from cohaptic_server.shell.wire import Wire

_KEPT_BYTES = 64 * 2**20
_MAX_WAITING = 128  # solves that are queued: two pages that look at hands far apart


class GreenBlocks:
    """Cache of encoded Green's functions by vertex; drops the least recently used block first.

    Args:
        solve: Finds the block of a vertex, called in another thread than the tick's; raises
            `Unsolved` if the process that solves for the columns has ended for good.
        kept_bytes: Size of the cache [bytes].

    Attributes:
        solved: Number of blocks solved so far.
    """

    def __init__(self, solve: Callable[[int], bytes], kept_bytes: int = _KEPT_BYTES) -> None:
        self._solve = solve
        self._kept_bytes = kept_bytes
        self._kept: OrderedDict[int, bytes] = OrderedDict()
        self._solving: dict[int, asyncio.Future[bytes]] = {}
        self._thread = ThreadPoolExecutor(1, "green")
        self._closed = False
        self.solved = 0

    @property
    def waiting(self) -> int:
        """Number of blocks that are being solved or queued."""
        return len(self._solving)

    async def blocks(self, vertices: Sequence[int], patience: float) -> bytes | None:
        """Return the blocks of some vertices one after the other; None as of `block`, of any."""
        found = await asyncio.gather(*(self.block(vertex, patience) for vertex in vertices))
        there = [block for block in found if block is not None]
        return b"".join(there) if len(there) == len(found) else None

    async def block(self, vertex: int, patience: float) -> bytes | None:
        """Return a vertex's block; None if it cannot be solved, or not within `patience` [s]."""
        if vertex in self._kept:
            self._kept.move_to_end(vertex)
            return self._kept[vertex]
        if vertex not in self._solving:
            if self._closed or len(self._solving) >= _MAX_WAITING:
                return None
            loop = asyncio.get_running_loop()
            task = loop.run_in_executor(self._thread, self._solve, vertex)
            task.add_done_callback(lambda done: self._keep(vertex, done))
            self._solving[vertex] = task
        # The solve goes on after a timeout, for the next request.
        solving = self._solving[vertex]
        try:
            return await asyncio.wait_for(asyncio.shield(solving), patience)
        except (TimeoutError, Unsolved):
            return None
        except asyncio.CancelledError:
            # `close` has cancelled the solve, not the request: the request still needs an answer.
            asking = asyncio.current_task()
            if solving.cancelled() and (asking is None or not asking.cancelling()):
                return None
            raise

    def close(self) -> None:
        """Cancel queued solves and accept no more; a request that waits for one gets None."""
        self._closed = True
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _keep(self, vertex: int, done: asyncio.Future[bytes]) -> None:
        del self._solving[vertex]
        if done.cancelled() or done.exception() is not None:
            return
        self.solved += 1
        self._kept[vertex] = done.result()
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > self._kept_bytes:
            self._kept.popitem(last=False)


DOWNLOAD_TIMEOUT = 15.0  # s for a file to go out
BLOCK_PATIENCE = 4.0  # s for a block to be solved, after which the page must ask again
_ALIVE = 2.0  # s since the last tick, within which the server counts as healthy


class HostCheck:
    """Checks that a request comes from an allowed page and names this server as its host."""

    def __init__(self, settings: ServerSettings) -> None:
        self._origins = settings.allow_origins
        # The owner of a page that may connect controls the name of that page, too.
        names = (urlsplit(origin).hostname for origin in settings.allow_origins)
        self._hosts = (*settings.allow_hosts, *(name for name in names if name))

    def __call__(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        """Return the refusal of a request, or None if the request passes."""
        origins, hosts = request.headers.get_all("Origin"), request.headers.get_all("Host")
        own = _own_address(connection)
        if "Upgrade" in request.headers:
            if len(origins) <= 1 and may_connect(
                origins[0] if origins else None,
                hosts[0] if len(hosts) == 1 else None,
                own=own,
                hosts=self._hosts,
                allowed=self._origins,
            ):
                return None
            message = (
                "a page from elsewhere may not use this server; see --allow-origin, and"
                " --allow-host for another name of this one\n"
            )
            return response(text(plain(request), 403, "Forbidden", message))
        # A page whose name was made to point here (DNS rebinding) may not read our files either.
        if request.path == "/healthz" or (
            len(hosts) == 1 and is_own_host(hosts[0], own, self._hosts)
        ):
            return None
        name = one_line(", ".join(hosts) or "(none)", 60)
        message = f"this server is not known as {name}; see --allow-host\n"
        return response(text(plain(request), 421, "Misdirected Request", message))


class Web:
    """HTTP service: serves files and Green's functions, and checks the origin of websockets.

    Args:
        body: Body whose Green's functions are served.
        limiter: Limiter with the rate limits and the clock of the server.
        solve: Finds the block of Green's functions of a vertex; None lets the body itself solve.
        endpoints: Further kinds of connections, by their subprotocols.

    Attributes:
        model: Name of the body's Green's functions; None if it has none.
        ticked: Time of the last tick [s].
    """

    def __init__(
        self,
        body: Body,
        settings: ServerSettings,
        limiter: ConnectionLimiter,
        solve: Callable[[int], bytes] | None = None,
        endpoints: Mapping[str, Endpoint] | None = None,
    ) -> None:
        self._endpoints: Mapping[str, Endpoint] = {} if endpoints is None else endpoints
        self._limiter, self._clock = limiter, limiter.clock
        self.ticked = self._clock.now()
        self._settings = settings
        self._check = HostCheck(settings)
        self._page = load_page()
        self._blocks: GreenBlocks | None = None
        self.serve(body, solve)

    def serve(self, body: Body, solve: Callable[[int], bytes] | None) -> None:
        """Serve the Green's functions of this body from now on; the call takes longer than a tick.

        Args:
            solve: Finds the block of Green's functions of a vertex; None lets the body itself
                solve.
        """
        source = green_source(body)
        model = None if source is None else model_name(source)
        blocks = None if source is None else GreenBlocks(solve or solver(source))
        site = Site(self._page, model, len(body.mesh.vertices), self._settings.allow_frames)
        self.close()
        self.model, self._blocks, self._site = model, blocks, site

    def allow_frames(self, origins: tuple[str, ...]) -> None:
        """Let pages of these origins, and of no others, show the page in a frame from now on.

        Raises:
            SettingError: An origin is none.
        """
        self._settings = replace(self._settings, allow_frames=origins)
        self._site.frames = origins

    async def process(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        """Return the response to a request, or None if the request may become a websocket."""
        plain_request, headers = plain(request), request.headers
        assert isinstance(connection, Wire)
        refusal = connection.come_from(headers)
        if refusal is not None:
            return response(too_many(plain_request, refusal))
        asked = _subprotocols(request) if "Upgrade" in headers else []
        endpoint = next((self._endpoints[name] for name in asked if name in self._endpoints), None)
        if endpoint is None and UPLOAD in asked:
            why = "this server takes no files; see --allow-upload\n"
            return response(text(plain_request, 403, "Forbidden", why))
        if endpoint is not None:
            return self._refuse_endpoint(connection, request, endpoint)
        refused = self._check(connection, request)
        if refused is not None:
            self._limiter.traffic.refused["origin or host"] += 1
        if refused is not None or "Upgrade" in headers:
            return refused
        room, path = split_path(request.path)
        if room is not None:
            if room != self._settings.room:
                message = f"there is no room {one_line(room, 60)} here\n"
                return response(text(plain_request, 404, "Not Found", message))
            if not path:  # relative addresses of the page begin behind the last slash
                query = query_without_token(request.path)
                return response(moved(plain_request, f"{room}/{query}"))
            plain_request = replace(plain_request, target=path)
        if plain_request.target == PATH and self._is_of_this_machine(connection, request):
            body = json.dumps({"hosts": self._hosts_for_others()}).encode()
            return response(page(plain_request, "application/json", body))
        # Time that the library waits for the peer to take the whole response.
        connection.close_timeout = DOWNLOAD_TIMEOUT
        ticking = self._clock.now() - self.ticked < _ALIVE
        answer = self._site.answer(plain_request, ticking=ticking)
        if isinstance(answer, BlocksNeeded):
            assert self._blocks is not None
            blocks = await self._blocks.blocks(answer.vertices, BLOCK_PATIENCE)
            # Another body, without this model, may have replaced the body meanwhile.
            gone = blocks is None and self._site.answer(plain_request, ticking=ticking)
            answer = gone if isinstance(gone, Answer) else green_blocks(plain_request, blocks)
        return counted(self._limiter, connection, plain_request, answer)

    def _hosts_for_others(self) -> tuple[str, ...]:
        settings = self._settings
        # Looked up for each request, since a laptop changes its address when it moves.
        return hosts_for_others(settings.host, settings.allow_hosts, machine_addresses())

    def _is_of_this_machine(
        self, connection: Wire, request: HttpRequest, allowed: Collection[str] = ()
    ) -> bool:
        """Whether a request comes from this machine, and from its own page or an allowed origin."""
        origins, hosts = request.headers.get_all("Origin"), request.headers.get_all("Host")
        return len(origins) <= 1 and is_of_this_machine(
            origins[0] if origins else None,
            hosts[0] if len(hosts) == 1 else None,
            connection.source,
            allowed=allowed,
        )

    def _refuse_endpoint(
        self, connection: Wire, request: HttpRequest, endpoint: Endpoint
    ) -> Response | None:
        """Return the refusal of a connection to an endpoint; None, and set limits, if allowed."""
        refused = None
        if not endpoint.own_page_only:
            refused = self._check(connection, request)
        elif not self._is_of_this_machine(connection, request, self._settings.allow_origins):
            why = "only the page of this server, on the same machine, may open this connection\n"
            refused = response(text(plain(request), 403, "Forbidden", why))
        if refused is None:
            connection.allow(endpoint.longest, as_fast_as_served=endpoint.as_fast_as_served)
        else:
            self._limiter.traffic.refused["origin or host"] += 1
        return refused

    @property
    def waiting(self) -> int:
        """Number of vertices whose Green's functions are being solved or queued."""
        return 0 if self._blocks is None else self._blocks.waiting

    def close(self) -> None:
        """Cancel the queued solves of Green's functions."""
        if self._blocks is not None:
            self._blocks.close()


def _subprotocols(request: HttpRequest) -> list[str]:
    listed = ",".join(request.headers.get_all("Sec-WebSocket-Protocol"))
    return [name.strip() for name in listed.split(",")]


def _own_address(connection: ServerConnection) -> str | None:
    """Return the local address of a connection; None if it is not known."""
    own: Any = connection.local_address
    return str(own[0]) if own and not isinstance(own, str) else None


def counted(
    limiter: ConnectionLimiter, connection: Wire, request: Request, answer: Answer
) -> Response:
    """Return the response, with its bytes counted; a refusal if too many unread bytes wait."""
    size = len(answer.body)
    refusal = limiter.sources.respond(connection.source, size, limiter.clock.now())
    if refusal is None:
        connection.count_response(size)
        return response(answer)
    limiter.traffic.spent["unread bytes"] += 1
    return response(too_many(request, refusal))


def too_many(request: Request, refusal: Refusal) -> Answer:
    """Return the response to a refused request, with the time after which to try again."""
    retry = ("Retry-After", str(int(refusal.retry) + 1))
    status = refusal.status
    return text(request, status.value, status.phrase, f"{refusal.why}\n", retry)


def solver(source: GreenSource) -> Callable[[int], bytes]:
    """Return a function that solves for a vertex's Green's functions and encodes them."""
    return lambda vertex: encode_block(source.green(vertex))


def plain(request: HttpRequest) -> Request:
    """Return the parts of a request of the library that determine the response."""
    # Before version 17 the library accepts only GET, and its requests have no method.
    method = str(getattr(request, "method", "GET"))
    return Request(method, request.path, ", ".join(request.headers.get_all("Accept-Encoding")))


def response(answer: Answer) -> Response:
    """Convert an answer to a response of the library."""
    return Response(answer.status, answer.phrase, Headers(answer.headers), answer.body)
