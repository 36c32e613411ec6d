"""State of one page that asked for news about the people in its room."""

from __future__ import annotations

import hmac
from dataclasses import dataclass, field

from cohaptic.protocol.control.company import Aim, Follower
from cohaptic_server.guard.budget import FULL
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
        user: Number of the user whose hand the page has proved, with `key`, to be its own; 0
            without a hand.
        key: Secret that the page has sent, to be compared with that of the user.
        open: Whether other pages may follow the page's view.
        following: Number of the user whose view this page follows; 0 if it follows nobody.
        aim: Viewpoint of the page; None before the page has sent it.
        aim_told: Whether the followers were told the newest `aim`.
        aimed: Time at which the followers were last told an `aim` [s].
        points: Token bucket of the rate limit on pointing.
        told: Last message about the people in the room that was queued for the page, encoded;
            None before the first.
    """

    watcher: Watcher
    mailbox: Mailbox
    name: str = ""
    user: int = 0
    key: str | None = field(default=None, repr=False)
    open: bool = False
    following: int = 0
    aim: Aim | None = None
    aim_told: bool = True
    aimed: float = LONG_AGO
    points: float = FULL
    told: str | None = None

    def owns(self, room: Room, user: int) -> bool:
        """Whether a user's hand belongs to this page, since both have the same secret."""
        member = room.members.get(user)
        key = None if member is None else member.hello.key
        return self.key is not None and key is not None and hmac.compare_digest(self.key, key)

    def called(self, room: Room) -> str:
        """Name under which others know this page: its user's name, or else the page's own name."""
        return room.members[self.user].hello.name if self.user in room.members else self.name

    def as_follower(self, room: Room) -> Follower:
        """Description of this page for the page that it follows."""
        return Follower(user=self.user or None, name=self.called(room) or "somebody")
