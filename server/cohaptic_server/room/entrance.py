"""Entrance of one room: checks the rate limit of joins, the token and its grants. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from cohaptic.protocol.messages import Hello
from cohaptic.protocol.watch_messages import Watch
from cohaptic.room_address import MAIN
from cohaptic_server.access.admission import Admission
from cohaptic_server.access.denied import forbidden
from cohaptic_server.access.remembered import Record, Removal, Used
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.removed import Removed


class Entrance:
    """Decides which clients may come into a room.

    Args:
        sources: Budgets of addresses, which limit the rate of joins.
        admission: The server's check of tokens; None if everybody may come in.
        room: Name of the room; None for the name of the main room.
        keep: Function that stores records which must outlive this process; None for no storage.

    Attributes:
        removed: Users who were put out of the room.
    """

    def __init__(
        self,
        sources: Sources | None = None,
        admission: Admission | None = None,
        room: str | None = None,
        keep: Callable[[Record], None] | None = None,
    ) -> None:
        self.sources = Sources(Limits()) if sources is None else sources
        self.admission = Admission() if admission is None else admission
        self.room = room or MAIN
        self.removed = Removed(keep)
        if keep is not None:
            self.admission.keep = keep

    def recall(self, records: Iterable[Record], now: float, to_wall: float) -> None:
        """Take over the records that earlier processes have kept; times as for `enter`."""
        for record in records:
            if isinstance(record, Removal):
                self.removed.recall(record, now, now + to_wall)
            elif isinstance(record, Used):
                self.admission.recall(record)

    def enter(self, peer: Peer, first: Hello | Watch, now: float, to_wall: float) -> str | None:
        """Identify a client by its token, and let the client in.

        Args:
            peer: Peer that has sent its first message; its `guest` and `ends` are set.
            first: First message of the peer.
            now: Time [s].
            to_wall: Time on the machine's wall clock minus `now` [s].

        Returns:
            Token with which the client comes back; None if the client needs no token.

        Raises:
            RemoteProtocolError: The client may not come in.
        """
        # The join is counted before the token is checked, so that a flood of wrong tokens is
        # bounded.
        self.sources.join(peer.source, now)
        wall = now + to_wall
        guest = self.admission.admit(first.token, self.room, wall)
        grants = guest.grants
        if isinstance(first, Hello) and not grants.can_touch:
            also = "you may watch" if grants.can_view else "ask the owner of the room for another"
            raise forbidden("the token does not let you touch (canTouch)", also)
        if isinstance(first, Watch) and not grants.can_view:
            raise forbidden("the token does not let you watch (canView)")
        peer.guest = guest
        peer.ends = now + (self.admission.ends(guest) - wall)
        return self.check(peer, first.name if isinstance(first, Hello) else "", now, to_wall)

    def begin(self, peer: Peer, now: float, to_wall: float) -> None:
        """Count a client's invitation as used, after it got a seat or a place in the queue."""
        self.admission.begin(peer.guest, now + to_wall)

    def check(self, peer: Peer, name: str, now: float, to_wall: float) -> str | None:
        """Let in a client whose `guest` is known: a new client, or one that waited for a seat.

        Args:
            peer: Peer that comes in.
            name: Name that the client touches under; empty if the client watches.
            now: Time [s].
            to_wall: Offset as for `enter`.

        Returns:
            Token as for `enter`.

        Raises:
            RemoteProtocolError: The client was put out.
        """
        self.removed.check(peer.guest, name, peer.source, now)
        return self.admission.session_token(peer.guest, now + to_wall)
