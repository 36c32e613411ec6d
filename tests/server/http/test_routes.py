from __future__ import annotations

import gzip
from urllib.parse import parse_qs, unquote

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cohaptic_server.http.routes import (
    MOST_VERTICES,
    POLICY,
    Answer,
    BlocksNeeded,
    PageFile,
    Request,
    Site,
    green_blocks,
    moved,
    query_without_token,
)

MODEL = "0123456789abcdef" * 2
HTML = b"<!doctype html>" + b" " * 200
PAGE = {
    "/index.html": PageFile("text/html; charset=utf-8", HTML, gzip.compress(HTML), hashed=False),
    "/assets/app-0a1b.js": PageFile("text/javascript; charset=utf-8", b"1", None, hashed=True),
}
SITE = Site(PAGE, MODEL, 42)


def ask(target: str, method: str = "GET", accepts: str = "", site: Site = SITE) -> Answer:
    answer = site.answer(Request(method, target, accepts), ticking=True)
    assert isinstance(answer, Answer)
    return answer


def header(answer: Answer, name: str) -> str | None:
    found = [value for key, value in answer.headers if key == name]
    assert len(found) <= 1
    return found[0] if found else None


methods = st.sampled_from(["GET", "HEAD", "POST", "PUT", "OPTIONS"])
pieces = st.sampled_from(
    ["/", "..", "%2e%2e", "//", "v1", "models", MODEL, "green", "0", "42", "assets", "etc", "\\"]
)
targets = st.text(max_size=60) | st.lists(pieces, max_size=10).map("/".join)


@given(methods, targets, st.text(max_size=20), st.booleans())
def test_every_answer_is_whole_and_guarded(
    method: str, target: str, accepts: str, ticking: bool
) -> None:
    answer = SITE.answer(Request(method, target, accepts), ticking=ticking)
    if isinstance(answer, BlocksNeeded):
        assert all(0 <= vertex < 42 for vertex in answer.vertices)
        answer = green_blocks(Request(method, target), b"block")
    assert header(answer, "Content-Security-Policy") == POLICY
    assert header(answer, "X-Content-Type-Options") == "nosniff"
    assert header(answer, "Referrer-Policy") == "no-referrer"
    assert header(answer, "Connection") == "close"
    length = int(header(answer, "Content-Length") or "-1")
    assert length == len(answer.body) or (method == "HEAD" and answer.body == b"" and length > 0)
    # Nothing of what came is in the headers, whose lines a stranger could break.
    for _, value in answer.headers:
        assert value.isprintable()
    if answer.status == 200:
        assert target.split("?")[0].split("#")[0] in ("/", "/index.html", "/healthz") or (
            MODEL in target
        )


def test_no_page_may_show_this_one_in_a_frame_unless_the_owner_names_it() -> None:
    lab = "https://lab.example"
    framed = Site(PAGE, MODEL, 42, (lab, "http://localhost:8000"))
    for target in ("/", "/index.html"):
        answer = framed.answer(Request("GET", target), ticking=True)
        assert not isinstance(answer, BlocksNeeded)
        policy = header(answer, "Content-Security-Policy")
        assert policy == POLICY.replace(
            "frame-ancestors 'none'", f"frame-ancestors {lab} http://localhost:8000"
        )
        assert header(answer, "X-Frame-Options") is None
    for site, target in ((framed, "/healthz"), (framed, "/nothing"), (SITE, "/")):
        answer = site.answer(Request("GET", target), ticking=True)
        assert not isinstance(answer, BlocksNeeded)
        assert header(answer, "Content-Security-Policy") == POLICY
        assert header(answer, "X-Frame-Options") == "DENY"


def test_the_policy_has_nothing_unsafe() -> None:
    assert "unsafe" not in POLICY
    assert POLICY.startswith("default-src 'none';")


@pytest.mark.parametrize(
    ("target", "status", "words"),
    [
        ("/nothing", 404, "nothing of this name"),
        ("/../pyproject.toml", 404, "nothing of this name"),
        ("/assets/../index.html", 404, "nothing of this name"),
        (f"/v1/models/{'0' * 32}/green/1", 404, MODEL),
        (f"/v1/models/{MODEL}/green/42", 404, "no vertex 42; the last is 41"),
        (f"/v1/models/{MODEL}/green/-1", 404, "nothing of this name"),
        (f"/v1/models/{MODEL}/green/1x", 404, "nothing of this name"),
        (f"/v1/models/{MODEL}/green/1,42,3", 404, "no vertex 42; the last is 41"),
        (f"/v1/models/{MODEL}/green/1,", 404, "nothing of this name"),
        (f"/v1/models/{MODEL}/green/{','.join(['1'] * 33)}", 404, "nothing of this name"),
        ("/healthz", 200, "ok"),
    ],
)
def test_what_is_not_there_is_said_plainly(target: str, status: int, words: str) -> None:
    answer = ask(target)
    assert answer.status == status
    assert words in answer.body.decode()
    assert header(answer, "Content-Type") == "text/plain; charset=utf-8"


def test_other_methods_are_refused() -> None:
    answer = ask("/", method="POST")
    assert answer.status == 405
    assert header(answer, "Allow") == "GET, HEAD"


def test_blocks() -> None:
    request = Request("GET", f"/v1/models/{MODEL}/green/41")
    assert SITE.answer(request, ticking=True) == BlocksNeeded((41,))
    many = tuple(range(MOST_VERTICES, 0, -1))
    asked = Request("GET", f"/v1/models/{MODEL}/green/{','.join(map(str, many))}")
    assert SITE.answer(asked, ticking=True) == BlocksNeeded(many)
    there = green_blocks(request, b"numbers")
    assert (there.status, there.body) == (200, b"numbers")
    assert header(there, "Cache-Control") == "public, max-age=31536000, immutable"
    busy = green_blocks(request, None)
    assert busy.status == 503
    assert header(busy, "Retry-After") == "1"
    assert header(busy, "Cache-Control") == "no-store"
    bare = Site(PAGE, None, 42)
    assert "no sum" in ask(request.target, site=bare).body.decode()


@given(st.text())
@example("main/?\x00")
@example("main/?a=%41&b=[1]")
def test_whatever_an_address_has_a_redirection_to_it_is_one_header_of_ascii(address: str) -> None:
    """A zero byte in a query ended in a 500: no header can hold it."""
    answer = moved(Request("GET", "/"), address)
    (location,) = [value for name, value in answer.headers if name == "Location"]
    assert all("!" <= character <= "~" for character in location)
    assert unquote(location) == unquote(address)


@pytest.mark.parametrize(
    ("query", "left"),
    [
        ("", ""),
        ("?", "?"),
        ("?token=secret", "?token="),
        ("?token", "?token="),
        ("?view=top&token=secret&name=a%26b", "?view=top&token=&name=a%26b"),
        ("?token=secret&Token=secret&%74oken=secret&+=1", "?token=&Token=&%74oken=&+=1"),
        ("?token=a=secret", "?token="),
        ("?tokens=1&x=token=2", "?tokens=1&x=token=2"),
        ("?x=1#token=secret", "?x=1"),
        ("#token=secret", ""),
        ("?token=secret?token=secret", "?token="),
        ("?%00=%ff&%74=1&token%20=secret&&=", "?%00=%ff&%74=1&token%20=&&="),
    ],
)
def test_a_query_keeps_all_but_the_value_of_a_token(query: str, left: str) -> None:
    assert query_without_token(f"/r/main{query}") == left


_PARTS = ["token", "%74oken", "Token", "=", "=", "&", "secret", "?", "#", "+", "%", "x"]


@given(st.lists(st.sampled_from(_PARTS)).map("".join))
def test_whatever_a_query_is_no_token_of_it_is_left(query: str) -> None:
    left = query_without_token(f"/r/main?{query}")
    assert parse_qs(left.partition("?")[2]).get("token") is None
