from __future__ import annotations

import json
import math
from urllib.parse import quote

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.recording.why import Entry, Why
from cohaptic_server.http.routes import Answer, Request
from cohaptic_server.http.session_routes import ScenesAsked, WhyAsked, answer, why_answer

OVERVIEW, MESH = {"name": "lab.mcap"}, b"\x00mesh"


def ask(target: str, method: str = "GET") -> Answer | ScenesAsked | WhyAsked | None:
    return answer(Request(method, target), OVERVIEW, MESH)


def test_the_page_is_sent_to_the_address_by_which_it_knows_the_session() -> None:
    for target, to in (("/", "?session"), ("/?view=engineer", "?session&view=engineer")):
        found = ask(target)
        assert isinstance(found, Answer)
        assert (found.status, dict(found.headers)["Location"]) == (307, to)
    for target in ("/?session", "/?session&t=3", "/assets/x.js", "/healthz"):
        assert ask(target) is None


def test_what_does_not_change_is_answered_at_once() -> None:
    overview, mesh = ask("/session.json"), ask("/session/mesh")
    assert isinstance(overview, Answer)
    assert isinstance(mesh, Answer)
    assert json.loads(overview.body) == OVERVIEW
    assert mesh.body == MESH


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(0, 2**32 - 1))
def test_a_question_is_read_as_it_was_meant(t: float, user: int) -> None:
    assert ask(f"/session/scenes?from={quote(repr(t))}&to=2.5") == ScenesAsked(t, 2.5)
    assert ask(f"/session/why?t={quote(repr(t))}&user={user}") == WhyAsked(user, t)


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("/session/scenes", "from 0 times"),
        ("/session/scenes?from=1", "to 0 times"),
        ("/session/scenes?from=1&from=2&to=3", "from 2 times"),
        ("/session/scenes?from=nan&to=3", "from is 'nan'; it must be a number"),
        ("/session/scenes?from=1&to=" + "9" * 400, "the query has 410 characters"),
        ("/session/scenes?from=1&to=1e999", "to is '1e999'"),
        ("/session/why?user=1.5&t=2", "user is 1.5; it must be the number of a user"),
        ("/session/why?user=-1&t=2", "user is -1"),
        ("/session/why?user=1&t=x", "t is 'x'"),
        ("/session/why?" + "&".join("a=1" for _ in range(20)), "fields"),
    ],
)
def test_a_question_without_an_answer_is_told_why(target: str, words: str) -> None:
    found = ask(target)
    assert isinstance(found, Answer)
    assert found.status == 400
    assert words in found.body.decode()


@pytest.mark.parametrize("path", ["/session.json", "/session/mesh", "/session/why?user=1&t=2"])
def test_nothing_can_be_written(path: str) -> None:
    found = ask(path, "POST")
    assert isinstance(found, Answer)
    assert found.status == 405


@given(st.text(max_size=80))
def test_no_request_fails(target: str) -> None:
    ask(f"/{target}")
    ask(f"/session/scenes?{target}")


def test_a_ledger_with_numbers_that_json_lacks_can_be_read() -> None:
    entry = Entry("surface", math.nan, "w")
    made = Why(1.0, math.inf, (entry,), (), {"gain": math.nan}, 0.02, ("r",), "s")
    said = json.loads(why_answer(Request("GET", "/"), made).body)
    assert said["force"] is None
    assert said["entries"] == [{"name": "surface", "newtons": None, "words": "w"}]
    assert json.loads(why_answer(Request("GET", "/"), None).body) is None
