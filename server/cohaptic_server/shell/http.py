"""The shell of the HTTP service: from requests of the websocket library to its responses."""

from __future__ import annotations

from collections.abc import Callable

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from cohaptic.clock import Clock
from cohaptic_server.bodies.body import Body
from cohaptic_server.http.green_functions import GreenSource, encode_block, green_source, model_name
from cohaptic_server.http.origins import may_connect
from cohaptic_server.http.page_files import load_page
from cohaptic_server.http.routes import Answer, BlockNeeded, Request, Site, green_block, text
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.green_blocks import GreenBlocks

DOWNLOAD_TIMEOUT = 15.0  # s for a file to go out
_PATIENCE = 4.0  # s for a block to be solved, after which the page must ask again
_ALIVE = 2.0  # s since the last tick, within which the server counts as healthy


class Web:
    """HTTP service: files, Green's functions, and the check of a websocket's origin.

    Args:
        body: Whose Green's functions are served.
        settings: Of the server.
        clock: Of the server.
        solve: Finds a vertex's block of the functions; the body itself does if not given.

    Attributes:
        model: Name of the body's Green's functions; None if it has none.
        ticked: Time of the last tick [s].
    """

    def __init__(
        self,
        body: Body,
        settings: ServerSettings,
        clock: Clock,
        solve: Callable[[int], bytes] | None = None,
    ) -> None:
        source = green_source(body)
        self.model = None if source is None else model_name(source)
        self.ticked = clock.now()
        self._clock = clock
        self._settings = settings
        self._blocks = None if source is None else GreenBlocks(solve or _solver(source))
        self._site = Site(load_page(), self.model, len(body.mesh.vertices))

    async def process(self, connection: ServerConnection, request: HttpRequest) -> Response | None:
        """Answer a request; None lets it become a websocket."""
        headers = request.headers
        # Before version 17 the library accepts GET alone, and its requests have no method.
        method = str(getattr(request, "method", "GET"))
        plain_request = Request(method, request.path, ", ".join(headers.get_all("Accept-Encoding")))
        if "Upgrade" in headers:
            origins, hosts = headers.get_all("Origin"), headers.get_all("Host")
            if len(origins) <= 1 and may_connect(
                origins[0] if origins else None,
                hosts[0] if len(hosts) == 1 else None,
                listens_on=self._settings.host,
                allowed=self._settings.allow_origins,
            ):
                return None
            message = "a page from elsewhere may not use this server; see --allow-origin\n"
            return _response(text(plain_request, 403, "Forbidden", message))
        # The library waits this long for the peer to take the whole response.
        connection.close_timeout = DOWNLOAD_TIMEOUT
        ticking = self._clock.now() - self.ticked < _ALIVE
        answer = self._site.answer(plain_request, ticking=ticking)
        if isinstance(answer, BlockNeeded):
            assert self._blocks is not None
            answer = green_block(plain_request, await self._blocks.block(answer.vertex, _PATIENCE))
        return _response(answer)

    def close(self) -> None:
        """Cancel the solves that are queued."""
        if self._blocks is not None:
            self._blocks.close()


def _solver(source: GreenSource) -> Callable[[int], bytes]:
    return lambda vertex: encode_block(source.green(vertex))


def _response(answer: Answer) -> Response:
    return Response(answer.status, answer.phrase, Headers(answer.headers), answer.body)
