"""Makes the responses to HTTP requests that come to the port of the websockets.

The files of the page are read when the server starts; the server serves no other file. Making a
response takes no I/O.
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import quote, unquote

FOLDER = Path(__file__).parents[1] / "page"  # built by `make page`
INDEX = "/index.html"

_TEXT_TYPES = {
    ".css": "text/css",
    ".html": "text/html",
    ".js": "text/javascript",
    ".json": "application/json",
    ".map": "application/json",
    ".svg": "image/svg+xml",
    ".txt": "text/plain",
    ".webmanifest": "application/manifest+json",
}
_UNKNOWN = "application/octet-stream"
_BINARY = {".ico": "image/x-icon", ".png": "image/png", ".wasm": "application/wasm"}


@dataclass(frozen=True, slots=True)
class PageFile:
    """One file of the page.

    Args:
        kind: Media type.
        body: Content.
        gzipped: Content compressed by gzip; None if that is not shorter or the file is binary.
        hashed: Whether the name contains a hash of the content, which then never changes.
    """

    kind: str
    body: bytes
    gzipped: bytes | None
    hashed: bool


def load_page(folder: Path = FOLDER) -> dict[str, PageFile]:
    """Read all files of the page, by their paths on the server; empty if the page was not built."""
    if not (folder / INDEX[1:]).is_file():
        return {}
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {f"/{path.relative_to(folder).as_posix()}": _page_file(path, folder) for path in files}


def has_page(page: Mapping[str, PageFile]) -> bool:
    """Check whether the files of the page were built."""
    return INDEX in page


def _page_file(path: Path, folder: Path) -> PageFile:
    body = path.read_bytes()
    text = _TEXT_TYPES.get(path.suffix)
    kind = f"{text}; charset=utf-8" if text else _BINARY.get(path.suffix, _UNKNOWN)
    gzipped = gzip.compress(body, mtime=0) if text else None
    # Vite writes files with a hash in their name into this folder.
    hashed = path.relative_to(folder).parts[0] == "assets"
    return PageFile(
        kind, body, gzipped if gzipped is not None and len(gzipped) < len(body) else None, hashed
    )


# The page loads nothing from elsewhere. Websockets to other hosts are allowed, since a page may
# connect to another server.
_SOURCES = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " connect-src 'self' ws: wss:; worker-src 'self'; manifest-src 'self'; base-uri 'none';"
    " form-action 'none'; frame-ancestors "
)
POLICY = f"{_SOURCES}'none'"
_UNFRAMED = ("X-Frame-Options", "DENY")  # for browsers that do not know frame-ancestors
_HEADERS = (
    ("Connection", "close"),
    ("Content-Security-Policy", POLICY),
    _UNFRAMED,
    ("Referrer-Policy", "no-referrer"),
    ("X-Content-Type-Options", "nosniff"),
)
_FOR_EVER = "public, max-age=31536000, immutable"
_ASK_AGAIN = "no-cache"
_TEXT = "text/plain; charset=utf-8"
_OF_ADDRESSES = "%/:?#[]@!$&'()*+,;=~"  # allowed in a URL beside letters and digits
# Vertices of one request: more than lie under most hands, since each request has its round trip.
MOST_VERTICES = 32
_GREEN = re.compile(
    rf"/v1/models/([0-9a-f]{{1,64}})/green/([0-9]{{1,9}}(?:,[0-9]{{1,9}}){{0,{MOST_VERTICES - 1}}})"
)
NOT_BUILT = (
    "cohaptic is running here, but its page was not built.\n\n"
    "In a checkout: make page (needs node 20 or newer), then start the server again.\n"
    "Without a page: cohaptic touch ws://HOST:PORT --name NAME\n"
)


@dataclass(frozen=True, slots=True)
class Request:
    """The parts of a request that determine the response.

    Args:
        method: HTTP method, such as GET.
        target: Path and query.
        accepts: Accept-Encoding header; empty if it is missing.
    """

    method: str
    target: str
    accepts: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """A complete HTTP response.

    Args:
        status: HTTP status code, such as 200.
        phrase: Name of the status.
        headers: Names and values, including the length.
        body: Content; empty for HEAD.
    """

    status: int
    phrase: str
    headers: tuple[tuple[str, str], ...]
    body: bytes


@dataclass(frozen=True, slots=True)
class BlocksNeeded:
    """Result of `Site.answer` if blocks of Green's functions have to be computed first.

    Args:
        vertices: Vertices on which the forces of the blocks act, in the order of the request.
    """

    vertices: tuple[int, ...]


class Site:
    """Answers requests for the page, for the health check `/healthz` and for Green's functions.

    Args:
        page: Files of the page by path; empty if the page was not built.
        model: Hash that names the body's Green's functions in URLs; None if the body has none.
        vertices: Number of vertices of the body.
        frames: Origins whose pages may show the page in a frame.

    Attributes:
        frames: As given; may be set anew.
    """

    def __init__(
        self,
        page: Mapping[str, PageFile],
        model: str | None,
        vertices: int,
        frames: Sequence[str] = (),
    ) -> None:
        self._page = page
        self.frames = tuple(frames)
        self._model = model
        self._vertices = vertices

    def answer(self, request: Request, *, ticking: bool) -> Answer | BlocksNeeded:
        """Return the response, or name the blocks of Green's functions that it needs first.

        Args:
            ticking: Whether the simulation is running.
        """
        if request.method not in ("GET", "HEAD"):
            message = f"{request.method[:16]} is not served here; GET and HEAD are\n"
            return text(request, 405, "Method Not Allowed", message, ("Allow", "GET, HEAD"))
        path = request.target.split("?", 1)[0].split("#", 1)[0]
        named = INDEX if path == "/" else path
        file = self._page.get(named)
        if file is not None:
            answer = _file(request, file)
            return framed(answer, self.frames) if named == INDEX and self.frames else answer
        if path == "/":
            return text(request, 200, "OK", NOT_BUILT)
        if path == "/healthz":
            if ticking:
                return text(request, 200, "OK", "ok\n")
            return text(request, 503, "Service Unavailable", "the server does not tick\n")
        return self._green(request, path)

    def _green(self, request: Request, path: str) -> Answer | BlocksNeeded:
        match = _GREEN.fullmatch(path)
        if match is None:
            return text(request, 404, "Not Found", "there is nothing of this name here\n")
        if self._model is None or match[1] != self._model:
            model = "none, since its surface is no sum" if self._model is None else self._model
            message = f"there is no such model here; the body's is {model}\n"
            return text(request, 404, "Not Found", message)
        vertices = tuple(int(number) for number in match[2].split(","))
        if max(vertices) >= self._vertices:
            message = f"there is no vertex {max(vertices)}; the last is {self._vertices - 1}\n"
            return text(request, 404, "Not Found", message)
        return BlocksNeeded(vertices)


def framed(answer: Answer, frames: Sequence[str]) -> Answer:
    """Return a copy of a response that pages of these origins may show in a frame.

    X-Frame-Options cannot list origins, so that header is removed; current browsers use
    `frame-ancestors` instead.
    """
    policy = ("Content-Security-Policy", _SOURCES + " ".join(frames))
    headers = (policy if header[0] == policy[0] else header for header in answer.headers)
    return replace(answer, headers=tuple(header for header in headers if header != _UNFRAMED))


def page(request: Request, kind: str, body: bytes, policy: str | None = None) -> Answer:
    """Make a response of any media type that browsers do not cache.

    Args:
        kind: Media type.
        policy: Content-Security-Policy of the response; None for that of the page.
    """
    whole = _answer(request, 200, "OK", kind, body, ("Cache-Control", "no-store"))
    if policy is None:
        return whole
    named = "Content-Security-Policy"
    headers = tuple((name, policy if name == named else value) for name, value in whole.headers)
    return replace(whole, headers=headers)


def moved(request: Request, location: str) -> Answer:
    """Make a temporary redirect to `location`; characters that no header can hold become %XX."""
    location = quote(location, safe=_OF_ADDRESSES)
    return text(request, 307, "Temporary Redirect", f"{location}\n", ("Location", location))


def query_without_token(target: str) -> str:
    """Return the query of a target, with its question mark but without the values of tokens.

    The values are removed because addresses end up in logs. The name `token` stays, so that the
    page can tell its visitor where tokens belong. The part behind a '#' is dropped, since no server
    needs it.
    """
    _, mark, query = target.partition("#")[0].partition("?")
    fields = (field.partition("=") for field in query.split("&"))
    return mark + "&".join(
        f"{name}=" if unquote(name).strip().lower() == "token" else f"{name}{sign}{value}"
        for name, sign, value in fields
    )


def green_blocks(request: Request, blocks: bytes | None) -> Answer:
    """Make the response with blocks of Green's functions; a 503 response if they are None."""
    if blocks is None:
        message = "too many are being solved; ask again\n"
        return text(request, 503, "Service Unavailable", message, ("Retry-After", "1"))
    kind = "application/octet-stream"
    return _answer(request, 200, "OK", kind, blocks, ("Cache-Control", _FOR_EVER))


def text(
    request: Request, status: int, phrase: str, message: str, *more: tuple[str, str]
) -> Answer:
    """Make a response in plain text that browsers do not cache; `more` are further headers."""
    caching = ("Cache-Control", "no-store")
    return _answer(request, status, phrase, _TEXT, message.encode(), caching, *more)


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
