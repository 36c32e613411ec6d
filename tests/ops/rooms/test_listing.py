from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import CloseCode
from cohaptic.room_address import room_path
from cohaptic_ops.rooms.listing import POLICY, RoomState, answer, room_of, turned_away
from cohaptic_server.http.routes import Request

ROOMS = [
    RoomState("main", "", "open", 1, 16, 2, 100),
    RoomState("liver", "<b>A liver", "full", 4, 4, 0, 10),
    RoomState("torn", "", "broken", 0, 4, 0, 10),
]


def get(target: str, method: str = "GET") -> tuple[int, str]:
    found = answer(Request(method, target), ROOMS)
    return found.status, found.body.decode()


@pytest.mark.parametrize(
    ("target", "rooms", "room"),
    [
        ("/", ["a", "main"], "main"),
        ("/assets/x.js", ["a", "main"], "main"),
        ("/", ["a"], "a"),
        ("/", ["a", "b"], None),
        ("/r/a", ["a", "b"], "a"),
        ("/r/a/", ["a", "b"], "a"),
        ("/r/a/v1/models/0/green/1?x", ["a", "b"], "a"),
        ("/r/c", ["a", "main"], None),
        ("/r/", ["a", "main"], None),
        ("/r/A", ["a"], None),
        ("/r/%61", ["a"], None),
        ("/rooms", ["a"], None),
        ("/rooms?x=1", ["main"], None),
        ("/rooms.html", ["main"], None),
        ("/healthz", ["main"], None),
        ("", ["main"], "main"),
    ],
)
def test_a_request_goes_to_its_room(target: str, rooms: list[str], room: str | None) -> None:
    assert room_of(target, rooms) == room


@pytest.mark.parametrize("listed", [True, False])
@pytest.mark.parametrize("target", ["/", "", "/?token=x", "/r/main", "/r/main/"])
def test_who_comes_before_its_room_is_open_is_told_to_come_again(target: str, listed: bool) -> None:
    starting = [RoomState("main", "", "starting", 0, 16, 0, 100), *ROOMS[1:]]
    code, why = turned_away(target, starting, listed=listed)
    assert code is CloseCode.SERVER_STOPS
    assert "try again in a moment" in why
    assert listed or "liver" not in why


def test_a_room_whose_name_nobody_may_know_is_not_named_to_who_did_not_name_it() -> None:
    secret = [RoomState("secret", "", "starting", 0, 16, 0, 100)]
    assert "secret" not in turned_away("/", secret, listed=False)[1]


@given(st.text(max_size=40))
def test_any_target_goes_to_a_room_that_exists_or_to_none(target: str) -> None:
    assert room_of(target, ["main", "a"]) in ("main", "a", None)
    assert answer(Request("GET", target), ROOMS).status in (200, 404, 503)


def test_the_list_has_every_room_with_its_state() -> None:
    status, body = get("/rooms")
    reported = json.loads(body)["rooms"]
    assert status == 200
    assert [room["name"] for room in reported] == ["main", "liver", "torn"]
    assert reported[1] == {
        "name": "liver", "title": "<b>A liver", "path": room_path("liver"), "state": "full",
        "users": 4, "max_users": 4, "watchers": 0, "max_watchers": 10,
    }  # fmt: skip


@pytest.mark.parametrize("target", ["/rooms", "/rooms.html", "/", "/rooms?x", "/healthz", "/r/x/"])
def test_where_rooms_are_not_listed_nobody_learns_their_names(target: str) -> None:
    found = answer(Request("GET", target), ROOMS, listed=False)
    expected = {"/healthz": 200, "/r/x/": 404}.get(target, 403)
    assert found.status == expected
    assert not any(room.name in found.body.decode() for room in ROOMS)


def test_the_page_links_every_room_offers_to_watch_a_full_one_and_quotes_titles() -> None:
    found = answer(Request("GET", "/"), ROOMS)
    body = found.body.decode()
    for room in ROOMS:
        assert f'href="./r/{room.name}/"' in body
    assert "You can watch" in body
    assert "<b>" not in body
    assert dict(found.headers)["Content-Security-Policy"] == POLICY
    assert "script" not in POLICY
