"""Anything that may be said in a room, in any order, as a state machine that hypothesis plays."""

from __future__ import annotations

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from cohaptic.protocol.control.company import Present
from cohaptic.protocol.messages import encode_control
from cohaptic_server.bodies.balloon.balloon import Balloon, BalloonSettings
from cohaptic_server.guard.limits import Budget, Limits
from cohaptic_server.room.peer import Peer
from tests.server.room.company.rooms import AIM, Played, key_of


class SharedViewsMachine(RuleBasedStateMachine):
    """Anything that pages and hands may say, in any order."""

    body = Balloon(BalloonSettings(subdivisions=2))

    def __init__(self) -> None:
        super().__init__()
        free = Budget(1e6, 1e6)
        self.room = Played(self.body, Limits(joins=free))
        self.hands: list[Peer] = []
        self.pages: list[Peer] = []

    @rule(name=st.sampled_from(["ann", "bob", "eve"]))
    def comes(self, name: str) -> None:
        hand = self.room.hand(name)
        if hand.user is not None:
            self.hands.append(hand)
        self.pages.append(self.room.page())

    @rule(k=st.integers(0, 9), which=st.booleans())
    def goes(self, k: int, which: bool) -> None:
        those = self.hands if which else self.pages
        if those:
            self.room.leave(those.pop(k % len(those)))

    @rule(k=st.integers(0, 9), name=st.sampled_from(["ann", "bob"]), opened=st.booleans())
    def presents(self, k: int, name: str, opened: bool) -> None:
        if self.pages:
            user = next((h.user for h in self.hands if h.user and k % 3), None)
            said = Present(name=name, user=user, key=key_of(name), open=opened)
            self.room.say(self.pages[k % len(self.pages)], said)

    @rule(k=st.integers(0, 9), user=st.integers(1, 12))
    def follows(self, k: int, user: int) -> None:
        if self.pages:
            self.room.follow(self.pages[k % len(self.pages)], user if k else None)

    @rule(k=st.integers(0, 9))
    def looks(self, k: int) -> None:
        if self.pages:
            self.room.say(self.pages[k % len(self.pages)], encode_control(AIM))

    @rule(k=st.integers(0, 9))
    def points(self, k: int) -> None:
        if self.pages:
            self.room.point(self.pages[k % len(self.pages)])

    @rule(seconds=st.sampled_from([0.01, 0.1, 0.3]))
    def time_goes_by(self, seconds: float) -> None:
        self.room.step(seconds)

    @invariant()
    def only_the_open_are_followed_and_nobody_in_a_chain(self) -> None:
        shared_views = self.room.session_host.shared_views
        by_user = {one.user: one for one in shared_views.visitors.values() if one.user}
        with_hands = [one for one in shared_views.visitors.values() if one.user]
        assert len(by_user) == len(with_hands)
        for one in shared_views.visitors.values():
            # Between two looks somebody may have left, and is not followed by anything then.
            host = by_user.get(one.following)
            if host is not None:
                assert host is not one
                assert host.open
                assert not host.following

    @invariant()
    def nobody_waits_for_more_than_is_bounded(self) -> None:
        for page in self.pages:
            assert page.session.close is None
            assert len(page.session.take(clear=True)) <= 64
