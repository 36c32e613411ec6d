"""The entrance of one room: the budget of joins, the token, and what it allows. No I/O."""

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
    """Who may come in.

    Args:
        sources: Budgets of addresses, which may not let too many join.
        admission: Admission of the server; without one anybody comes in.
        room: Name of the room; that of the only one if not given.
        keep: Called with what has to outlive this process.

    Attributes:
        removed: Who was put out.
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
        """Take up what earlier processes have kept; times as for `enter`."""
        for record in records:
            if isinstance(record, Removal):
                self.removed.recall(record, now, now + to_wall)
            elif isinstance(record, Used):
                self.admission.recall(record)

    def enter(self, peer: Peer, first: Hello | Watch, now: float, to_wall: float) -> str | None:
        """Learn who somebody is, and let it in.

        Args:
            peer: Who has sent its first message; its `guest` is set.
            first: The message.
            now: Time [s].
            to_wall: Offset of that time to the machine's wall clock [s].

        Returns:
            Token with which it comes back; None for one who needs none.

        Raises:
            RemoteProtocolError: It may not come in.
        """
        # Counted before the token is looked at, so that a flood of wrong ones is bounded.
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
        """Count the invitation of one who was let in just now, and has a seat or a place."""
        self.admission.begin(peer.guest, now + to_wall)

    def check(self, peer: Peer, name: str, now: float, to_wall: float) -> str | None:
        """Let somebody in whose `guest` is known: one who comes, or who has waited for a seat.

        Args:
            peer: Who it is.
            name: That it touches by; empty for one who watches.
            now: Time [s].
            to_wall: As for `enter`, and the result.

        Raises:
            RemoteProtocolError: It was put out.
        """
        self.removed.check(peer.guest, name, peer.source, now)
        return self.admission.session_token(peer.guest, now + to_wall)
