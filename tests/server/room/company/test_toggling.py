"""One who says something else all the time costs a room and its others a bounded work."""

from __future__ import annotations

import pytest

from cohaptic.protocol.control.company import Company, Present
from cohaptic.protocol.control.message import ControlMessage
from cohaptic.protocol.messages import encode_control
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.room.company import shared_views
from cohaptic_server.room.company.shared_views import NEWS_AT_ONCE, REPORT_EVERY
from tests.server.room.company.rooms import Played, heard, key_of


def test_a_page_that_toggles_as_fast_as_it_can_makes_four_messages_a_second(
    small_balloon: Balloon,
) -> None:
    room = Played(small_balloon)
    ann, page = room.person("ann")
    hostile = room.page()
    room.step()
    heard(page)
    reported = 0
    for k in range(120):  # two seconds
        room.follow(hostile, ann.user if k % 2 else None)
        room.say(hostile, Present(name=f"n{k}"))
        room.step(1 / 60)
        reported += len(heard(page))
    assert reported <= 2.0 / REPORT_EVERY + 1


def test_a_tick_makes_few_news_however_many_concern_and_in_the_end_all_are_told(
    small_balloon: Balloon, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One who toggles would have a message made for each page in one tick, of 10 ms and more."""
    made: list[int] = []

    def make(news: ControlMessage) -> str:
        if isinstance(news, Company):
            made.append(1 + len(news.followers))
        return encode_control(news)

    monkeypatch.setattr(shared_views, "encode_control", make)
    free = Budget(1e6, 1e6)
    room = Played(small_balloon, Limits(joins=free), max_users=64)
    people = [room.person(f"p{k}") for k in range(40)]
    others = [room.page() for _ in range(60)]
    for k, page in enumerate(others):
        room.follow(page, people[k % 40][0].user)
    pages = [*others, *(page for _, page in people)]
    for opened in (True, False):
        first, toggles = people[0]
        said = Present(name="p0", user=first.user, key=key_of("p0"), open=opened)
        room.say(toggles, said)
        reported: list[Company] = []
        for tick in range(60):
            room.step(REPORT_EVERY if tick == 0 else 0.0)
            assert sum(made[:-1]) < NEWS_AT_ONCE  # the last may be the one that is too much
            made.clear()
            reported += [
                news for page in pages for news in heard(page) if isinstance(news, Company)
            ]
        assert len(reported) == len(pages)
        assert {(first.user in news.open) for news in reported} == {opened}
