"""A thread that watches a room, at real servers."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Generator, Iterator
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.room_lag import RoomLag
from cohaptic.errors import CohapticError, ServerLost
from cohaptic.protocol.scene_users import SceneUsers, UserRecord
from cohaptic_client import ClientSettings, joined
from cohaptic_client.network.conversation import Refused
from cohaptic_client.notebook.watched_room import Seen, WatchedRoom, seen_in
from cohaptic_server import ServedRoom, serve
from tests.patience import PATIENCE
from tests.strategies import user_records


@given(st.lists(user_records, max_size=4, unique_by=lambda record: record.user), st.data())
def test_a_user_is_seen_by_name_exactly_while_it_has_one(
    records: list[UserRecord], data: st.DataObject
) -> None:
    named = [record for record in records if data.draw(st.booleans())]
    names = {record.user: f"user {record.user}" for record in named}
    seen = seen_in(SceneUsers(7, 0.0, tuple(records), RoomLag(0.0, 0.0, 0.0), 0), names)
    assert seen == (
        7,
        {names[record.user]: record.probe for record in named},
        {names[record.user]: record.force for record in named},
    )


class Heard:
    """What a watched room shows and says, in order."""

    def __init__(self) -> None:
        self.seen = queue.Queue[Seen]()
        self.said = queue.Queue[str]()

    def until(self, holds: Callable[[Seen], bool]) -> Seen:
        while not holds(seen := self.seen.get(timeout=PATIENCE)):
            pass
        return seen

    def hear(self, word: str) -> str:
        while word not in (said := self.said.get(timeout=PATIENCE)):
            pass
        return said


@contextlib.contextmanager
def watched(url: str, rate: float = 30.0) -> Generator[Heard]:
    heard = Heard()
    room = WatchedRoom(ClientSettings(url, "view"), rate, heard.seen.put, heard.said.put)
    room.open()
    try:
        yield heard
    finally:
        room.close()


@pytest.fixture(scope="module")
def room() -> Iterator[ServedRoom]:
    with serve("balloon", port=0) as served:
        yield served


@pytest.mark.live
def test_it_shows_who_presses_and_that_they_have_left(room: ServedRoom) -> None:
    with watched(room.url) as heard:
        assert heard.hear("watching") == "watching balloon"
        with joined(room.url, name="ann") as ann:
            x, y, z = ann.body.center
            ann.move_to((x + ann.body.radius - 0.01, y, z), 0.3)
            seen = heard.until(lambda seen: seen.forces.get("ann", (0.0,))[0] > 2.0)
            assert seen.tips["ann"][0] < x + ann.body.radius
            assert set(seen.tips) == set(seen.forces) == {"ann"}
        heard.until(lambda seen: seen.forces == {})


@pytest.mark.live
def test_it_shows_no_more_than_the_rate_allows(room: ServedRoom) -> None:
    rate = 5.0
    with joined(room.url, name="ann"), watched(room.url, rate) as heard:
        ticks = [heard.until(lambda seen: True).tick for _ in range(7)]
    gaps = sorted(after - before for before, after in pairwise(ticks))
    # The server's rate is 60 ticks a second. A scene that came late is followed soon by the next,
    # so that single gaps prove nothing.
    assert gaps[len(gaps) // 2] >= 0.5 * room.settings.simulation_hz / rate


@pytest.mark.live
def test_the_end_of_a_server_is_said_and_shown_until_it_is_back() -> None:
    with contextlib.ExitStack() as stack, contextlib.ExitStack() as server:
        room = server.enter_context(serve("balloon", port=0))
        heard = stack.enter_context(watched(room.url))
        stack.enter_context(joined(room.url, name="ann"))
        heard.until(lambda seen: "ann" in seen.forces)
        server.close()
        heard.hear("not connected")
        assert heard.until(lambda seen: seen.forces == {}).tips == {}
        stack.enter_context(serve("balloon", port=int(room.url.rpartition(":")[2])))
        heard.hear("watching balloon")
        heard.until(lambda seen: "ann" in seen.forces)


@pytest.mark.live
def test_where_no_server_answers_it_says_so_at_once_and_has_no_thread_left() -> None:
    before = threading.active_count()
    with serve("balloon", port=0) as room:
        url = room.url
    with pytest.raises(ServerLost, match="cohaptic serve"), watched(url):
        pytest.fail("it watches nothing")
    with pytest.raises(CohapticError, match="not an address"), watched("nowhere"):
        pytest.fail("it watches nothing")
    assert threading.active_count() == before


@pytest.mark.live
def test_a_refusal_at_the_beginning_is_an_error() -> None:
    with (
        serve("balloon", port=0, max_watchers=0) as room,
        pytest.raises(Refused),
        watched(room.url),
    ):
        pytest.fail("there is no place for who watches")


@pytest.mark.live
def test_an_error_of_the_notebook_ends_it_and_is_said(room: ServedRoom) -> None:
    said = queue.Queue[str]()
    ended = queue.Queue[BaseException | None]()

    def wrong(seen: Seen) -> None:
        raise ValueError("of the author")

    def of_thread(raised: threading.ExceptHookArgs) -> None:
        ended.put(raised.exc_value)

    hook, threading.excepthook = threading.excepthook, of_thread
    try:
        watching = WatchedRoom(ClientSettings(room.url, "view"), 30.0, wrong, said.put)
        watching.open()
        assert isinstance(ended.get(timeout=PATIENCE), ValueError)
        watching.close()
    finally:
        threading.excepthook = hook
    assert list(said.queue) == ["watching balloon", "ended: ValueError('of the author')"]
