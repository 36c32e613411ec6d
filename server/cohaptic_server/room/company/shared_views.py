"""People in a room, followed views and pointing: a state machine without I/O.

A `Visitor` is the state of one page that asked for news about the people in its room. The package's
docstring defines the terms.

Rules that hold whatever the pages send:
- A view is followed only while its owner has a hand in the room and allows followers.
- Nobody follows a page that itself follows another one, so there are no chains and no circles.
- A view has a bounded number of followers.
- A page gets at most one message about the people per `TOLD_EVERY`, and one with the followed view
  per `AIMED_EVERY`.
- Only pages that asked for news get it; handling a message costs little more than reading it.

Followers and followed users are found from either side without a search, since a room may have a
thousand pages.
"""

from __future__ import annotations

import hmac
from collections.abc import Collection, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field

from cohaptic.protocol.control.company import (
    MAX_FOLLOWERS,
    MAX_OPEN,
    Aim,
    Aimed,
    Company,
    CompanyRequest,
    Declined,
    Follow,
    Follower,
    Point,
    Pointed,
    Present,
)
from cohaptic.protocol.messages import encode_control
from cohaptic_server.guard.limits import FULL, spend
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.room import Room
from cohaptic_server.room.watch.watcher import Mailbox, Watcher

LONG_AGO = float("-inf")


@dataclass(eq=False)
class Visitor:
    """Page of a person who watches, and may touch as well.

    Attributes:
        watcher: Protocol session of the page.
        mailbox: Mailbox for news to the page.
        name: Name that the page gave itself; empty before that.
        user: Number of the user that the page has proved, with `key`, to be its own; 0 without a
            user.
        key: Secret that the page has sent, to be compared with that of the user.
        open: Whether other pages may follow the page's view.
        following: Number of the user whose view this page follows; 0 if it follows nobody.
        aim: Viewpoint of the page's camera; None before the page has sent it.
        aim_told: Whether the newest `aim` was sent to the followers.
        aimed: Time at which an `aim` was last sent to the followers [s].
        points: Token bucket of the rate limit on pointing.
        reported: Last message about the people in the room that was queued for the page,
            encoded; None before the first.
    """

    watcher: Watcher
    mailbox: Mailbox
    name: str = ""
    user: int = 0
    key: str | None = field(default=None, repr=False)
    open: bool = False
    following: int = 0
    aim: Aim | None = None
    aim_reported: bool = True
    aimed: float = LONG_AGO
    points: float = FULL
    reported: str | None = None

    def owns(self, room: Room, user: int) -> bool:
        """Whether a user belongs to this page: both clients have sent the same secret."""
        member = room.members.get(user)
        key = None if member is None else member.hello.key
        return self.key is not None and key is not None and hmac.compare_digest(self.key, key)

    def called(self, room: Room) -> str:
        """Return the name by which others know this page: its user's name, or else its own name."""
        return room.members[self.user].hello.name if self.user in room.members else self.name

    def as_follower(self, room: Room) -> Follower:
        """Describe this page for the page that it follows."""
        return Follower(user=self.user or None, name=self.called(room) or "somebody")


class Follows:
    """Relations between pages and users in one room: who follows whom, and whose hand is whose.

    Only this class sets `Visitor.following` and `Visitor.user`.
    """

    def __init__(self) -> None:
        self._followers: dict[int, dict[Visitor, None]] = {}  # by user, in the order of following
        self._pages: dict[int, Visitor] = {}

    @property
    def users(self) -> tuple[int, ...]:
        """Numbers of the users who have followers."""
        return tuple(self._followers)

    @property
    def pages(self) -> Collection[Visitor]:
        """Pages that have a hand in the room."""
        return self._pages.values()

    def of(self, user: int) -> tuple[Visitor, ...]:
        """Return the pages that follow a user; empty for user 0."""
        return tuple(self._followers.get(user, ()))

    def count(self, user: int) -> int:
        """Return the number of pages that follow a user."""
        return len(self._followers.get(user, ()))

    def page(self, user: int) -> Visitor | None:
        """Return the page that a user belongs to; None if there is no such page."""
        return self._pages.get(user)

    def follow(self, visitor: Visitor, user: int) -> None:
        """Make a page follow a user; user 0 makes the page stop following."""
        before = self._followers.get(visitor.following)
        if before is not None:
            before.pop(visitor, None)
            if not before:
                del self._followers[visitor.following]
        visitor.following = user
        if user:
            self._followers.setdefault(user, {})[visitor] = None

    def take_hand(self, visitor: Visitor, user: int) -> Visitor | None:
        """Assign a user to a page as its hand; user 0 takes the hand away from the page.

        Returns:
            Page that had this hand before, and has no hand now; None if there was no such page.
        """
        if visitor.user and self._pages.get(visitor.user) is visitor:
            del self._pages[visitor.user]
        visitor.user = user
        other = self._pages.pop(user, None) if user else None
        if user:
            self._pages[user] = visitor
        if other is not None:
            other.user = 0
        return other

    def leave(self, visitor: Visitor) -> None:
        """Remove a page that has left from all relations."""
        self.follow(visitor, 0)
        self.take_hand(visitor, 0)


REPORT_EVERY = 0.25  # s between two checks of who is in the room
AIMED_EVERY = 0.1  # s between two messages with the view of a followed user
# Limit on the messages that one tick encodes, plus the followers named in them; each takes up to
# 30 us, and one page that toggles can change all messages. The others wait for the next tick.
NEWS_AT_ONCE = 32
_REPORTED = object()


class SharedViews:
    """Tells the pages of one room who is there, whose view is followed, and who points.

    Args:
        room: Room with the users.
        watchers: Watchers of the room; the set that the scene broadcast maintains.
        sources: Rate limits of the network addresses, which also limit pointing.

    Attributes:
        visitors: Pages that asked for news about the people in the room, by watcher.
    """

    def __init__(self, room: Room, watchers: AbstractSet[Watcher], sources: Sources) -> None:
        self.room = room
        self.visitors: dict[Watcher, Visitor] = {}
        self._follows = Follows()
        self._watchers = watchers
        self._sources = sources
        self._looked = float("-inf")  # [s]
        self._seen: tuple[object, ...] = ()
        self._changed = True
        self._telling: Iterator[None] | None = None  # messages about the last check, unfinished

    def hear(self, watcher: Watcher, said: CompanyRequest, source: str, now: float) -> None:
        """Carry out a request of a page, or tell the page why the request is declined.

        Args:
            watcher: Protocol session of the page.
            said: Request of the page.
            source: Network address against whose rate limits the page's connection counts.
            now: Time [s].
        """
        self._meet(watcher)
        visitor = self.visitors.get(watcher)
        if visitor is None:
            return  # the watcher was not accepted
        self._check_hand(visitor)
        match said:
            case Present():
                self._present(visitor, said)
            case Follow():
                self._follow(visitor, said.user)
            case Aim():
                # The message may have been on its way when the last follower left, so a view
                # without followers is no error.
                if visitor.user and visitor.open:
                    visitor.aim, visitor.aim_reported = said, False
            case Point():
                self._point(visitor, said, source, now)

    def step(self, now: float) -> None:
        """Send all pages the changes that are due; to be called at every tick."""
        if self._telling is None and (now - self._looked >= REPORT_EVERY or now < self._looked):
            self._looked = now
            self._telling = self._tell_company() if self._look() else None
        if self._telling is not None and next(self._telling, _REPORTED) is _REPORTED:
            self._telling = None
        for visitor in self._follows.pages:
            if not visitor.aim_reported and (
                now - visitor.aimed >= AIMED_EVERY or now < visitor.aimed
            ):
                visitor.aimed, visitor.aim_reported = now, True
                self._tell_aim(visitor, self._follows.of(visitor.user))

    def _meet(self, watcher: Watcher) -> None:
        if watcher.mailbox is not None and watcher.hears_news and watcher not in self.visitors:
            self.visitors[watcher] = Visitor(watcher, watcher.mailbox)
            self._changed = True

    def _look(self) -> bool:
        """Check who has come and gone since the last check; return whether pages must be told."""
        for watcher in self._watchers:
            self._meet(watcher)
        for watcher in [one for one in self.visitors if one not in self._watchers]:
            self._follows.leave(self.visitors.pop(watcher))
            self._changed = True
        room = self.room
        if not self.visitors:
            return False
        names = tuple((user, one.hello.name) for user, one in room.members.items())
        seen = (len(self._watchers), names)
        if seen == self._seen and not self._changed:
            return False
        self._seen, self._changed = seen, False
        for visitor in tuple(self._follows.pages):
            self._check_hand(visitor)
        for user in self._follows.users:
            self._end_if_closed(user)
        return True

    def _tell_company(self) -> Iterator[None]:
        """Send the company to all pages for which it changed; yield after `NEWS_AT_ONCE` messages.

        The caller continues the iterator at the next tick.
        """
        room, follows = self.room, self._follows
        watching = len(self._watchers) - len(follows.pages)
        open_ones = tuple(sorted(one.user for one in follows.pages if self._is_open(one)))
        # Most of a thousand watchers are told the same, so each message is encoded once.
        news: dict[tuple[int, Visitor | None, bool], str] = {}
        made = 0
        for visitor in tuple(self.visitors.values()):
            followers = follows.of(visitor.user)
            may_point = room.settings.watchers_point or bool(visitor.user)
            which = (visitor.following, visitor if followers else None, may_point)
            if which not in news:
                company = Company(
                    watching=watching,
                    open=open_ones[:MAX_OPEN],
                    following=visitor.following or None,
                    followers=tuple(one.as_follower(room) for one in followers),
                    may_point=may_point,
                )
                news[which] = encode_control(company)
                made += 1 + len(followers)
            if visitor.reported != news[which]:
                visitor.reported = news[which]
                visitor.mailbox.put_company(news[which])
            if made >= NEWS_AT_ONCE:
                made = 0
                yield

    def _check_hand(self, visitor: Visitor) -> None:
        """Take the hand away from a page if the user of that hand has left the room."""
        if visitor.user and not visitor.owns(self.room, visitor.user):
            self._follows.take_hand(visitor, 0)
            visitor.open, self._changed = False, True

    def _end_if_closed(self, user: int) -> None:
        """Make all pages stop following a user if that user's view may not be followed any more."""
        reason = self._why_closed(user)
        if not reason:
            return
        for follower in self._follows.of(user):
            self._follows.follow(follower, 0)
            self._changed = True
            follower.watcher.send(Declined(what="follow", reason=reason))

    def _present(self, visitor: Visitor, said: Present) -> None:
        before = visitor.user
        visitor.name, visitor.key = said.name, said.key
        proved = said.user is not None and visitor.owns(self.room, said.user)
        # A newly opened page takes the hand over from an older page.
        other = self._follows.take_hand(visitor, said.user or 0 if proved else 0)
        if other is not None:
            other.open = False
        visitor.open = said.open and proved
        self._changed = True
        if not visitor.open:
            visitor.aim = None
        for user in {before, visitor.user} - {0}:
            self._end_if_closed(user)

    def _follow(self, visitor: Visitor, user: int | None) -> None:
        if user is None:
            self._changed = self._changed or visitor.following != 0
            self._follows.follow(visitor, 0)
            return
        reason = self._why_not(visitor, user)
        if reason:
            visitor.watcher.send(Declined(what="follow", reason=reason))
            return
        if visitor.following == user:
            return
        self._follows.follow(visitor, user)
        self._changed = True
        if visitor.user:
            self._end_if_closed(visitor.user)
        host = self._follows.page(user)
        if host is not None:
            self._tell_aim(host, [visitor])

    def _why_not(self, visitor: Visitor, user: int) -> str:
        """Return the reason why a page cannot follow a user; empty if it can."""
        if visitor.user == user:
            return "That is your own view."
        closed = self._why_closed(user)
        if closed:
            return closed
        others = self._follows.count(user) - int(visitor.following == user)
        if others >= MAX_FOLLOWERS:
            name = self.room.name_of(user)
            return f"{MAX_FOLLOWERS} see what {name} sees already, which is the most."
        return ""

    def _why_closed(self, user: int) -> str:
        """Return the reason why no page can follow a user; empty if the user's view is open."""
        if user not in self.room.members:
            return "Whom you wanted to follow has left."
        name, host = self.room.name_of(user), self._follows.page(user)
        if host is None:
            return f"{name} touches without a page: there is no view to follow."
        if not host.open:
            return f"{name} keeps its view to itself."
        if host.following:
            return f"{name} sees what {self.room.name_of(host.following)} sees: follow that one."
        return ""

    def _is_open(self, visitor: Visitor) -> bool:
        return bool(visitor.user) and visitor.open and not visitor.following

    def _tell_aim(self, host: Visitor, followers: Sequence[Visitor]) -> None:
        aim = host.aim
        if aim is None or not followers:
            return
        aimed = Aimed(
            user=host.user, azimuth=aim.azimuth, elevation=aim.elevation, distance=aim.distance
        )
        text = encode_control(aimed)
        for follower in followers:
            follower.mailbox.put_aimed(text)

    def _point(self, visitor: Visitor, said: Point, source: str, now: float) -> None:
        reason = self._why_not_point(visitor, source, now)
        if reason:
            visitor.watcher.send(Declined(what="point", reason=reason))
            return
        name = visitor.called(self.room)
        text = encode_control(Pointed(user=visitor.user or None, name=name, point=said.point))
        for other in self.visitors.values():
            other.mailbox.put_pointed(visitor, text)

    def _why_not_point(self, visitor: Visitor, source: str, now: float) -> str:
        limits = self._sources.limits
        if not visitor.called(self.room):
            return "Nobody knows your name yet."
        if not visitor.user and not self.room.settings.watchers_point:
            return "In this room only those who touch may point."
        if visitor.user and self.room.members[visitor.user].muted:
            return "An administrator has muted you."
        left = spend(visitor.points, 1.0, limits.points, now)
        if left is None:
            return f"You point too often: at most {limits.points}."
        visitor.points = left
        if not self._sources.point(source, now):
            return f"From your address people point too often: at most {limits.points_in_all}."
        return ""
