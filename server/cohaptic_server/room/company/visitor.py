"""What is known of one page that wants to hear who else is here."""

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
    """The page of one who watches, and may touch as well.

    Attributes:
        watcher: Its session.
        mailbox: Mailbox of the session.
        name: That it gave itself; empty before it said one.
        user: Number of its hand, as its key has proved; 0 without a hand.
        key: Key of that hand.
        open: Whether its view may be followed.
        following: Number of the user whose view it is sent; 0 for nobody's.
        aim: From where it looks; None before it said so.
        aim_told: Whether its followers know that.
        aimed: When they were told last [s].
        points: Bucket of how often it points.
        told: What it knows of the company, encoded.
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
        """Whether the hand of this number is this page's: both have the same secret."""
        member = room.members.get(user)
        key = None if member is None else member.hello.key
        return self.key is not None and key is not None and hmac.compare_digest(self.key, key)

    def called(self, room: Room) -> str:
        """By which others know it."""
        return room.members[self.user].hello.name if self.user in room.members else self.name

    def as_follower(self, room: Room) -> Follower:
        """As it is told to the one whom it follows."""
        return Follower(user=self.user or None, name=self.called(room) or "somebody")
