"""Who is counted, who follows whom, who points; what nobody can do."""

from __future__ import annotations

import pytest
from hypothesis import settings as hypothesis_settings

from cohaptic.errors import CloseCode
from cohaptic.protocol.control.company import (
    MAX_FOLLOWERS,
    Aimed,
    Declined,
    Follower,
    Pointed,
    Present,
)
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.room.company.shared_views import AIMED_EVERY
from cohaptic_server.room.peer import Peer
from tests.examples_of_laws import examples
from tests.server.room.company.machines import SharedViewsMachine
from tests.server.room.company.rooms import Played, company_of, heard, key_of


def test_who_did_not_ask_hears_nothing_of_it_and_may_say_nothing(small_balloon: Balloon) -> None:
    room = Played(small_balloon)
    old, (_, page) = room.page(company=False), room.person("ann")
    room.step()
    room.point(page)
    assert [type(news).__name__ for news in heard(old)] == ["Watching", "UserJoined"]
    room.point(old)
    assert old.session.close is not None
    assert old.session.close[0] == CloseCode.BAD_MESSAGE.value
    assert page.session.close is None


def test_a_view_is_followed_and_both_know_it(small_balloon: Balloon) -> None:
    room = Played(small_balloon)
    ann, page = room.person("ann")
    watcher = room.page()
    room.say(watcher, Present(name="bob"))
    room.aim(page, 0.5)
    room.follow(watcher, ann.user)
    room.step()
    reported = heard(watcher)
    assert [news.azimuth for news in reported if isinstance(news, Aimed)] == [0.5]
    assert next(news for news in reported if isinstance(news, Aimed)).user == ann.user
    assert company_of(page).followers == (Follower(user=None, name="bob"),)
    room.follow(watcher, None)
    room.step()
    assert company_of(page).followers == ()
    assert company_of(watcher).following is None
    room.aim(page, 0.7)
    room.step()
    assert not [news for news in heard(watcher) if isinstance(news, Aimed)]


def test_a_follower_hears_the_newest_view_ten_times_a_second_however_many_come(
    small_balloon: Balloon,
) -> None:
    room = Played(small_balloon)
    ann, page = room.person("ann")
    watcher = room.page()
    room.follow(watcher, ann.user)
    views: list[float] = []
    for k in range(60):
        for part in range(20):
            room.aim(page, 0.001 * (20 * k + part))
        room.step(1 / 60)
        views += [news.azimuth for news in heard(watcher) if isinstance(news, Aimed)]
    assert len(views) <= 1.0 / AIMED_EVERY + 1
    assert views == sorted(views)
    assert views[-1] > 1.05
    # One who reads nothing has one view waiting, and not sixty.
    for _ in range(60):
        room.aim(page)
        room.step(1 / 60)
    assert len([news for news in heard(watcher) if isinstance(news, Aimed)]) == 1


def test_a_refusal_is_a_sentence_and_ends_what_was_followed(small_balloon: Balloon) -> None:
    room = Played(small_balloon)
    ann, page = room.person("ann", open_view=False)
    native = room.hand("native")
    bob, bobs = room.person("bob")
    watcher = room.page()
    room.step()
    assert company_of(watcher).open == (bob.user,)

    def why(user: int | None, who: Peer = watcher) -> str:
        room.follow(who, user)
        (declined,) = [news for news in heard(who) if isinstance(news, Declined)]
        return str(declined.reason)

    assert why(ann.user) == "ann keeps its view to itself."
    assert why(native.user) == "native touches without a page: there is no view to follow."
    assert why(99) == "Whom you wanted to follow has left."
    assert why(bob.user, bobs) == "That is your own view."
    room.follow(watcher, bob.user)
    room.step()
    assert company_of(watcher).following == bob.user
    room.say(bobs, Present(name="bob", user=bob.user, key=key_of("bob"), open=False))
    room.aim(bobs)
    reported = heard(watcher)
    assert [type(news) for news in reported] == [Declined]
    room.step()
    reported = heard(watcher)
    assert not [news for news in reported if isinstance(news, Aimed)]
    assert reported[-1].following is None
    assert page.session.close is None


def test_there_are_no_chains_and_no_circles(small_balloon: Balloon) -> None:
    room = Played(small_balloon)
    (ann, anns), (bob, bobs) = room.person("ann"), room.person("bob")
    watcher = room.page()
    room.follow(watcher, ann.user)
    room.follow(anns, bob.user)  # what ann sees is bob's view now, so nobody follows ann
    (ended,) = [news for news in heard(watcher) if isinstance(news, Declined)]
    assert ended.reason == "ann sees what bob sees: follow that one."
    room.follow(bobs, ann.user)
    assert [news.reason for news in heard(bobs) if isinstance(news, Declined)] == [ended.reason]
    room.step()
    assert company_of(bobs).followers == (Follower(user=ann.user, name="ann"),)


def test_only_the_page_of_a_hand_shows_its_view(small_balloon: Balloon) -> None:
    room = Played(small_balloon)
    ann, page = room.person("ann")
    liar = room.page()
    for key in (None, key_of("bob"), key_of("ann")[:-1]):
        room.say(liar, Present(name="ann", user=ann.user, key=key, open=True))
        room.aim(liar)
    watcher = room.page()
    room.follow(watcher, ann.user)
    room.aim(liar, 3.0)
    room.aim(page, 0.25)
    room.step()
    assert [news.azimuth for news in heard(watcher) if isinstance(news, Aimed)] == [0.25]
    again = room.page()  # the page was loaded anew
    room.say(again, Present(name="ann", user=ann.user, key=key_of("ann"), open=True))
    room.aim(page, 2.0)
    room.aim(again, -1.0)
    room.step()
    assert [news.azimuth for news in heard(watcher) if isinstance(news, Aimed)] == [-1.0]
    room.leave(ann)
    room.step()
    assert company_of(watcher).open == ()


def test_a_view_has_a_bounded_number_of_followers(small_balloon: Balloon) -> None:
    room = Played(small_balloon)
    ann, _ = room.person("ann")
    pages = [room.page(source=f"10.0.1.{k}") for k in range(MAX_FOLLOWERS + 1)]
    for page in pages:
        room.follow(page, ann.user)
    assert not [news for news in heard(pages[-2]) if isinstance(news, Declined)]
    (full,) = [news for news in heard(pages[-1]) if isinstance(news, Declined)]
    assert full.reason == f"{MAX_FOLLOWERS} see what ann sees already, which is the most."


def test_everybody_sees_who_points_and_nobody_can_be_somebody_else(
    small_balloon: Balloon,
) -> None:
    room = Played(small_balloon)
    ann, page = room.person("ann")
    watcher = room.page()
    room.say(watcher, Present(name="ann", user=ann.user, key=key_of("not ann")))
    room.point(page)
    room.point(watcher)
    for one in (page, watcher):
        first, second = [news for news in heard(one) if isinstance(news, Pointed)]
        assert (first.user, first.name, first.point) == (ann.user, "ann", (0.1, 0.0, 0.0))
        assert (second.user, second.name) == (None, "ann")


def test_who_points_too_often_is_told_the_limit_and_nobody_else_pays(
    small_balloon: Balloon,
) -> None:
    points, in_all = Budget(0.5, 2), Budget(2, 3)
    room = Played(small_balloon, Limits(points=points, points_in_all=in_all))
    pages = [room.page(), room.page(), room.page(source="10.0.0.2")]
    for k, page in enumerate(pages):
        room.say(page, Present(name=f"p{k}"))

    def answers(page: Peer, times: int) -> list[str]:
        heard(page)
        for _ in range(times):
            room.point(page)
        return [news.reason for news in heard(page) if isinstance(news, Declined)]

    assert answers(pages[0], 3) == ["You point too often: at most 0.5 a second and 2 at once."]
    often = "From your address people point too often: at most 2 a second and 3 at once."
    assert answers(pages[1], 2) == [often]
    assert answers(pages[2], 2) == []
    room.now += 2.0
    assert answers(pages[0], 1) == []


@pytest.mark.parametrize(
    "text",
    [
        '{"type":"aim","azimuth":NaN,"elevation":0,"distance":4}',
        '{"type":"aim","azimuth":8,"elevation":0,"distance":4}',
        '{"type":"aim","azimuth":0,"elevation":1.7,"distance":4}',
        '{"type":"aim","azimuth":0,"elevation":0,"distance":0}',
        '{"type":"aim","azimuth":0,"elevation":0,"distance":1e9}',
        '{"type":"point","point":[0,0,11]}',
        '{"type":"point","point":[0,0]}',
        '{"type":"follow","user":0}',
        '{"type":"follow"}',
        '{"type":"present","name":"a\\nb"}',
        '{"type":"present","name":"a","key":"short","user":1}',
    ],
)
def test_what_is_out_of_its_range_ends_the_session_that_said_it_alone(
    small_balloon: Balloon, text: str
) -> None:
    room = Played(small_balloon)
    ann, page = room.person("ann")
    hostile = room.page()
    room.follow(hostile, ann.user)
    room.say(hostile, text)
    assert hostile.session.close is not None
    assert hostile.session.close[0] == CloseCode.BAD_MESSAGE.value
    room.leave(hostile)
    room.step()
    assert company_of(page).followers == ()


TestGatherings = SharedViewsMachine.TestCase
TestGatherings.settings = hypothesis_settings(max_examples=examples(40), stateful_step_count=40)
