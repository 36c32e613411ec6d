"""Who somebody is, by the token of its first message, and the token that it comes back with.

An invitation begins a session. The token of the session is signed by the server, goes to this one
client, and brings it back with the same grants, also when the invitation has ended meanwhile, or
was good for one time: for as long as the owner says.

A token that may be used once is remembered when it was used, in a memory that is bounded.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module

from cohaptic_server.access.denied import Denied, forbidden
from cohaptic_server.access.grants import OPEN, Grants
from cohaptic_server.access.keys import KeyRing
from cohaptic_server.access.remembered import MOST_USED, Used


class UsedTokens:
    """Names of tokens that were used and have not ended yet.

    Args:
        most: How many are remembered.
    """

    def __init__(self, most: int = MOST_USED) -> None:
        self._most = most
        self._ends: dict[str, float] = {}

    def __len__(self) -> int:
        return len(self._ends)

    def recall(self, jti: str, ends: float) -> None:
        """Count a token as used that an earlier process has taken; arguments as for `use`."""
        if len(self._ends) < self._most:
            self._ends[jti] = ends

    def use(self, jti: str, ends: float, now: float) -> None:
        """Count a token as used.

        Args:
            jti: Its name.
            ends: When it is refused for its age, in any case [s].
            now: Time [s].

        Raises:
            Denied: As for `check`.
        """
        self.check(jti, now)
        self._ends[jti] = ends

    def check(self, jti: str, now: float) -> None:
        """Raise Denied where a token was used before, or too many are remembered.

        Args:
            jti: Its name.
            now: Time [s].
        """
        if self._ends.get(jti, now) > now:
            raise Denied("the token was used before, and it is good for one time")
        if len(self._ends) >= self._most:
            self._ends = {name: end for name, end in self._ends.items() if end > now}
        if len(self._ends) >= self._most:
            later = "try again later"
            raise Denied(f"{self._most} tokens for one time are in use, the limit", later)


# s after which a session needs an invitation to come back, a long day in a lab. One that is
# connected stays.
SESSION_LIFE = 12 * 3600.0


@dataclass(frozen=True, slots=True)
class Guest:
    """Somebody who may come in.

    Args:
        grants: What for.
        sub: Who it is, as its token says; empty for one without.
        session: Name of its session; empty for one without a token.
        invitation: Name of the invitation that it began with; empty for none.
        since: When the session began, Unix time [s].
        until: When that invitation ends, Unix time [s]; None where nobody knows.
        spends: Until when its token for one time is remembered as used, once it has a seat or a
            place; Unix time [s]. None for one that spends nothing.
    """

    grants: Grants = OPEN
    sub: str = ""
    session: str = ""
    invitation: str = ""
    since: float = 0.0
    until: float | None = None
    spends: float | None = field(default=None, compare=False)


ANYBODY = Guest()


def session_over() -> Denied:
    """The refusal, and the end, of a session whose invitation has ended too long ago."""
    return Denied("the session has ended with its invitation")


class Admission:
    """Whom one server takes in.

    Args:
        ring: Keys of tokens; None where nobody has one.
        admits_anybody: Whether one without a token may come in.
        single_use: Whether an invitation is good for one time.
        session_valid: For how long after the end of its invitation a session lasts [s]; None for
            no end of one that is connected.
        draw: Makes names that nobody can guess.
        keep: Called with each token for one time that is used, for processes to come.

    Attributes:
        ring: Keys that are accepted; another takes its place when keys are rotated.
        admits_anybody: Whether one without a token may come in.
        keep: As given; a server that has a file for it puts it here.
    """

    def __init__(
        self,
        ring: KeyRing | None = None,
        *,
        admits_anybody: bool = True,
        single_use: bool = False,
        session_valid: float | None = None,
        draw: Callable[[], str] = lambda: secrets.token_hex(16),
        keep: Callable[[Used], None] | None = None,
    ) -> None:
        if ring is not None:
            # Tokens bring libraries of cryptography, a tenth of the start of a server, which one
            # without keys does not need. One with keys has them before anybody comes.
            import_module("cohaptic_server.access.tokens")
        self.ring = ring
        self.admits_anybody = admits_anybody
        self._used = UsedTokens() if single_use else None
        self._session_valid = session_valid
        self._draw = draw
        self.keep = keep

    def recall(self, used: Used) -> None:
        """Count a token as used that an earlier process has taken."""
        if self._used is not None:
            self._used.recall(used.jti, used.ends)

    def admit(self, token: str | None, room: str, now: float) -> Guest:
        """Who has this token; one for one time is not used up by it alone, but by `begin`.

        Args:
            token: Token of the first message; None without one.
            room: That it wants to come into.
            now: Unix time [s].

        Raises:
            Denied: It may not come in.
        """
        # A client may have a token for every server, and one that asks for none has no use for it.
        if self.ring is None or token is None:
            if self.admits_anybody:
                return ANYBODY
            advice = "open the link of your invitation, or give --token or COHAPTIC_TOKEN"
            raise Denied("this server takes in nobody without a token", advice)
        from cohaptic_server.access.tokens import LEEWAY, verify

        claims = verify(token, self.ring, now)
        grants = claims.haptic
        if not grants.hold_in(room):
            raise forbidden(f"the token is for the room {grants.room}, and this is {room}")
        if not grants.room_join:
            raise forbidden("the token does not let you join the room (roomJoin)")
        session = claims.session
        if session is not None:
            if now >= session.began + SESSION_LIFE:
                raise Denied(f"the session began more than {SESSION_LIFE / 3600:g} hours ago")
            began = (session.sid, session.invitation, session.began, session.until)
            guest = Guest(grants, claims.sub, *began)
            if now >= self.ends(guest):
                raise session_over()
            return guest
        spends = None
        if self._used is not None:
            self._used.check(claims.jti, now)
            spends = claims.exp + LEEWAY
        return Guest(grants, claims.sub, self._draw(), claims.jti, now, claims.exp, spends)

    def begin(self, guest: Guest, now: float) -> None:
        """Use up the token of one who was just admitted and has found what it came for.

        Args:
            guest: Who it is.
            now: Unix time [s].
        """
        if self._used is None or guest.spends is None:
            return
        self._used.use(guest.invitation, guest.spends, now)
        if self.keep is not None:
            self.keep(Used(jti=guest.invitation, ends=guest.spends))

    def ends(self, guest: Guest) -> float:
        """When whoever is connected by a session has to go, Unix time [s]; infinite for never."""
        if self._session_valid is None or not guest.session:
            return float("inf")
        # An invitation that has begun a session had not ended then, but for clocks that differ.
        until = guest.since if guest.until is None else guest.until
        return until + self._session_valid

    def session_token(self, guest: Guest, now: float) -> str | None:
        """With which a guest comes back; None for one who needs none."""
        ends = min(guest.since + SESSION_LIFE, self.ends(guest))
        if self.ring is None or not guest.session or ends <= now:
            return None
        from cohaptic_server.access.tokens import SESSION_AUDIENCE, Claims, Session, sign

        claims = Claims(
            sub=guest.sub,
            jti=self._draw(),
            iat=now,
            exp=ends,
            haptic=guest.grants,
            session=Session(
                sid=guest.session,
                began=guest.since,
                invitation=guest.invitation,
                until=guest.until,
            ),
        )
        return sign(claims, self.ring.signer, SESSION_AUDIENCE)
