"""From an HTTP request to its answer, on the port that serves websockets too. No I/O."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from cohaptic_server.http.page_files import INDEX, PageFile

# The page needs nothing from elsewhere and no code but its files; websockets of other hosts are
# allowed since a page may be pointed at another server.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " connect-src 'self' ws: wss:; worker-src 'self'; manifest-src 'self'; base-uri 'none';"
    " form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = (
    ("Connection", "close"),
    ("Content-Security-Policy", POLICY),
    ("Referrer-Policy", "no-referrer"),
    ("X-Content-Type-Options", "nosniff"),
)
_FOR_EVER = "public, max-age=31536000, immutable"
_ASK_AGAIN = "no-cache"
_TEXT = "text/plain; charset=utf-8"
_GREEN = re.compile(r"/v1/models/([0-9a-f]{1,64})/green/([0-9]{1,9})")
NOT_BUILT = (
    "cohaptic is running here, but its page was not built.\n\n"
    "In a checkout: make page (needs node 20 or newer), then start the server again.\n"
    "Without a page: cohaptic touch ws://HOST:PORT --name NAME\n"
)


@dataclass(frozen=True, slots=True)
class Request:
    """What of a request counts.

    Args:
        method: GET, say.
        target: Path and query.
        accepts: The header Accept-Encoding; empty without one.
    """

    method: str
    target: str
    accepts: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """A whole response.

    Args:
        status: 200, say.
        phrase: Its name.
        headers: By name, the length among them.
        body: Empty for HEAD.
    """

    status: int
    phrase: str
    headers: tuple[tuple[str, str], ...]
    body: bytes


@dataclass(frozen=True, slots=True)
class GreenWanted:
    """A block of Green's functions is to be solved first.

    Args:
        vertex: Whose.
    """

    vertex: int


class Site:
    """What is served.

    Args:
        page: Files by path; empty if the page was not built.
        model: Of the body's Green's functions; None if it has none.
        vertices: Of the body.
    """

    def __init__(self, page: Mapping[str, PageFile], model: str | None, vertices: int) -> None:
        self._page = page
        self._model = model
        self._vertices = vertices

    def answer(self, request: Request, *, ticking: bool) -> Answer | GreenWanted:
        """The response, or what has to be found out before.

        Args:
            request: From anybody.
            ticking: Whether the server does its work.
        """
        if request.method not in ("GET", "HEAD"):
            words = f"{request.method[:16]} is not served here; GET and HEAD are\n"
            return text(request, 405, "Method Not Allowed", words, ("Allow", "GET, HEAD"))
        path = request.target.split("?", 1)[0].split("#", 1)[0]
        file = self._page.get(INDEX if path == "/" else path)
        if file is not None:
            return _file(request, file)
        if path == "/":
            return text(request, 200, "OK", NOT_BUILT)
        if path == "/healthz":
            if ticking:
                return text(request, 200, "OK", "ok\n")
            return text(request, 503, "Service Unavailable", "the server does not tick\n")
        return self._green(request, path)

    def _green(self, request: Request, path: str) -> Answer | GreenWanted:
        wanted = _GREEN.fullmatch(path)
        if wanted is None:
            return text(request, 404, "Not Found", "there is nothing of this name here\n")
        if self._model is None or wanted[1] != self._model:
            here = "none, since its surface is no sum" if self._model is None else self._model
            words = f"there is no such model here; the body's is {here}\n"
            return text(request, 404, "Not Found", words)
        if int(wanted[2]) >= self._vertices:
            words = f"there is no vertex {int(wanted[2])}; the last is {self._vertices - 1}\n"
            return text(request, 404, "Not Found", words)
        return GreenWanted(int(wanted[2]))


def green_block(request: Request, block: bytes | None) -> Answer:
    """The response with a block, or without one: it could not be solved in time."""
    if block is None:
        words = "too many are being solved; ask again\n"
        return text(request, 503, "Service Unavailable", words, ("Retry-After", "1"))
    kind = "application/octet-stream"
    return _answer(request, 200, "OK", kind, block, ("Cache-Control", _FOR_EVER))


def text(request: Request, status: int, phrase: str, words: str, *more: tuple[str, str]) -> Answer:
    """A response in plain words, which nobody keeps."""
    caching = ("Cache-Control", "no-store")
    return _answer(request, status, phrase, _TEXT, words.encode(), caching, *more)


def _file(request: Request, file: PageFile) -> Answer:
    more: list[tuple[str, str]] = [("Cache-Control", _FOR_EVER if file.hashed else _ASK_AGAIN)]
    body = file.body
    if file.gzipped is not None:
        more.append(("Vary", "Accept-Encoding"))
        codings = [coding.split(";")[0].strip() for coding in request.accepts.split(",")]
        if "gzip" in codings:
            body = file.gzipped
            more.append(("Content-Encoding", "gzip"))
    return _answer(request, 200, "OK", file.kind, body, *more)


def _answer(
    request: Request, status: int, phrase: str, kind: str, body: bytes, *more: tuple[str, str]
) -> Answer:
    headers = (*_HEADERS, ("Content-Type", kind), ("Content-Length", str(len(body))), *more)
    return Answer(status, phrase, headers, b"" if request.method == "HEAD" else body)
