"""The widget in a kernel's place: its traits, what it stores, and what its front end asks."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Iterator
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

import cohaptic
from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError, SettingError
from cohaptic_client import joined
from cohaptic_server import ServedRoom, serve
from cohaptic_server.access.admission import Admission
from cohaptic_server.shell.limiter import Protection
from tests.patience import PATIENCE
from tests.server.access.some import RING, token

pytest.importorskip("anywidget", reason="pip install 'cohaptic[notebook]'")

from cohaptic_client.notebook.opening import MOST
from cohaptic_client.notebook.room_widget import RoomWidget, page_address

CLOCK = SystemClock()
ORIGIN = "http://localhost:8888"


@pytest.fixture(scope="module")
def room() -> Iterator[ServedRoom]:
    with serve("balloon", port=0) as served:
        yield served


def test_the_page_of_a_server_has_its_token_where_no_server_sees_it() -> None:
    assert page_address("ws://h:1") == "http://h:1/?view=people"
    assert page_address("wss://h/r/liver", "a.b+c") == (
        "https://h/r/liver/?view=people#token=a.b%2Bc"
    )
    proxied = "https://hub.example/user/ann/proxy/8765/"
    assert page_address(proxied) == f"{proxied}?view=people"


@given(st.text(max_size=30))
def test_what_is_no_address_of_a_page_is_refused(text: str) -> None:
    with pytest.raises(SettingError, match="ws://HOST:PORT"):
        page_address(f"javascript:{text}")
    with pytest.raises(SettingError, match="ws://HOST:PORT"):
        page_address(text.replace(":", ""))


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"rate": 0.5}, "rate"),
        ({"rate": float("nan")}, "rate"),
        ({"height": 50}, "height"),
        ({"page": "localhost:8765"}, "address"),
    ],
)
def test_a_value_outside_its_limits_is_refused(options: dict[str, Any], name: str) -> None:
    with pytest.raises(SettingError, match=name):
        cohaptic.view("ws://127.0.0.1:1", **options)


def test_without_anywidget_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(SettingError, match=r"pip install 'cohaptic\[notebook\]'"):
        cohaptic.view("ws://127.0.0.1:1")


def test_a_room_that_is_not_served_is_refused() -> None:
    with pytest.raises(SettingError, match="not served"):
        cohaptic.view(serve("balloon", port=0))


@pytest.mark.live
def test_its_traits_are_those_of_one_tick_and_can_be_observed(room: ServedRoom) -> None:
    view = cohaptic.view(room)
    pressed = threading.Event()

    def heard(change: Any) -> None:
        assert change.new == view.tick
        assert set(view.forces) == set(view.tips)
        if view.forces.get("ann", (0.0,))[0] > 2.0:
            pressed.set()

    view.observe(heard, "tick")
    with joined(room.url, name="ann") as ann:
        x, y, z = ann.body.center
        ann.move_to((x + ann.body.radius - 0.01, y, z), 0.3)
        assert pressed.wait(PATIENCE)
        assert "ann" in repr(view)
        assert view.tips["ann"][0] == pytest.approx(ann.tip[0], abs=0.02)
    view.unobserve(heard, "tick")
    view.close()
    assert view.status == "closed"


@pytest.mark.live
def test_the_front_end_gets_the_address_and_the_notebook_stores_no_token(
    room: ServedRoom, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[dict[str, str]] = []

    def send(view: RoomWidget, content: dict[str, str]) -> None:
        sent.append(content)

    monkeypatch.setattr(RoomWidget, "send", send)
    view = cast(Any, cohaptic.view(room, token="secret-of-ann"))

    def ask(content: object) -> None:
        view._handle_custom_msg(content, [])  # as ipywidgets does

    ask(None)
    ask([ORIGIN])
    ask({"origin": ORIGIN})
    ask({"origin": 3, "request": "1"})
    ask({"origin": 301 * "x", "request": "1"})
    assert sent == []
    before = room.settings
    ask({"origin": ORIGIN, "request": "1"})
    ask({"origin": "vscode-webview://1c2d", "request": "2"})
    assert [answer["request"] for answer in sent] == ["1", "2"]
    assert sent[0]["address"] == f"{room.page}?view=people#token=secret-of-ann"
    assert (before.allow_frames, room.settings.allow_frames) == ((), (ORIGIN,))
    assert "secret" not in json.dumps(view.get_state())
    view.close()


@pytest.mark.live
def test_an_invitation_for_one_time_is_enough_for_view_and_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sent: list[dict[str, str]] = []

    def send(view: RoomWidget, content: dict[str, str]) -> None:
        sent.append(content)

    monkeypatch.setattr(RoomWidget, "send", send)
    now = CLOCK.now() + CLOCK.to_wall()
    invitation = token(iat=now, exp=now + 600.0)
    protection = Protection(Admission(RING, admits_anybody=False, single_use=True))
    with serve("balloon", port=0, protection=protection) as room:
        view = cast(Any, cohaptic.view(f"{room.page}#token={invitation}"))
        view._handle_custom_msg({"origin": ORIGIN, "request": "1"}, [])
        # What the frame gets is the session; by the invitation nobody comes in any more.
        cohaptic.view(sent[0]["address"]).close()
        with pytest.raises(CohapticError, match="used"):
            cohaptic.view(room, token=invitation)
        view.close()


@pytest.mark.live
def test_a_cell_that_runs_again_and_again_leaves_a_bounded_number_of_threads(
    room: ServedRoom,
) -> None:
    before = threading.active_count()
    views = [cohaptic.view(room) for _ in range(MOST + 2)]
    assert threading.active_count() == before + MOST
    assert [view.status == "closed" for view in views] == [True, True] + MOST * [False]
    for view in views:
        view.close()
    assert threading.active_count() == before
