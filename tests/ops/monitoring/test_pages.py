"""Requests at an admin port, and their responses."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic_ops.monitoring.admin_process import answer
from cohaptic_ops.monitoring.known import Known
from cohaptic_ops.monitoring.overview import Status
from cohaptic_server.http.routes import Request
from tests.ops.monitoring.some import health, room, ticking, user


def get(known: Known, target: str, method: str = "GET", now: float = 1.0) -> tuple[int, bytes]:
    found = answer(Request(method, target), known, now)
    return found.status, found.body


def test_health_and_readiness_differ_while_the_server_drains() -> None:
    known = ticking()
    assert get(known, "/readyz")[0] == get(known, "/healthz")[0] == 200
    known.take(health(draining=True), 1.0)
    assert get(known, "/healthz")[0] == 200
    status, body = get(known, "/readyz")
    assert status == 503
    assert json.loads(body)["reasons"] == ["the server is draining"]


def test_the_state_is_what_the_terminal_view_reads() -> None:
    known = ticking(room(users=(user(name="a\x1b[2J"),), margin=None))
    status, body = get(known, "/status")
    assert status == 200
    reported = Status.model_validate_json(body)
    assert reported.ready
    assert reported.rooms[0].metrics is not None
    assert reported.rooms[0].metrics.users[0].name == "a\x1b[2J"
    assert b"\x1b" not in body  # escaped


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "\x1b[2J"])
def test_nothing_can_be_changed(method: str) -> None:
    assert get(ticking(), "/status", method)[0] == 405


@given(st.text(max_size=60))
def test_whatever_is_asked_there_is_an_answer(target: str) -> None:
    assert get(ticking(), target)[0] in (200, 404, 503)
    assert get(ticking(), f"/readyz?{target}")[0] in (200, 404)
    assert answer(Request("HEAD", f"/{target}"), ticking(), 1.0).body == b""
