"""Identifies a client by the token of its first message, and gives it a token for coming back.

An invitation begins a session. The server signs a session token and gives it to this one client,
which can come back with the same grants, even if the invitation has expired meanwhile or was for
single use. The owner sets how long this is possible.

The server remembers which single-use tokens were used, in bounded memory.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module

from cohaptic_server.access.keys import OPEN, Denied, Grants, KeyRing, forbidden
from cohaptic_server.access.remembered import MAX_USED, Used


class UsedTokens:
    """Memory of single-use tokens that were used and have not expired yet.

    Args:
        limit: Largest number of tokens that are remembered.
    """

    def __init__(self, limit: int = MAX_USED) -> None:
        self._limit = limit
        self._ends: dict[str, float] = {}

    def __len__(self) -> int:
        return len(self._ends)

    def recall(self, jti: str, ends: float) -> None:
        """Mark a token as used because an earlier process accepted it; arguments as in `use`."""
        if len(self._ends) < self._limit:
            self._ends[jti] = ends

    def use(self, jti: str, ends: float, now: float) -> None:
        """Mark a token as used.

        Args:
            jti: Name of the token.
            ends: Unix time from which the token is refused as expired [s].
            now: Unix time [s].

        Raises:
            Denied: The token was used before, or too many tokens are remembered.
        """
        self.check(jti, now)
        self._ends[jti] = ends

    def check(self, jti: str, now: float) -> None:
        """Check that a token can still be used.

        Args:
            jti: Name of the token.
            now: Unix time [s].

        Raises:
            Denied: The token was used before, or too many tokens are remembered.
        """
        if self._ends.get(jti, now) > now:
            raise Denied("the token was used before, and it is good for one time")
        if len(self._ends) >= self._limit:
            self._ends = {name: end for name, end in self._ends.items() if end > now}
        if len(self._ends) >= self._limit:
            later = "try again later"
            raise Denied(f"{self._limit} tokens for one time are in use, the limit", later)


# Age of a session after which its client needs an invitation to come back [s]: a long day in a lab.
# A connected client stays.
SESSION_LIFE = 12 * 3600.0


@dataclass(frozen=True, slots=True)
class Guest:
    """A person whom the server admits, as `Admission.admit` identifies the person.

    Args:
        grants: Actions that the person is allowed.
        sub: Identity that the token states; empty without a token.
        session: Name of the session; empty without a token.
        invitation: Name of the invitation that began the session; empty without a token.
        since: Time at which the session began, Unix time [s].
        until: Time at which that invitation ends, Unix time [s]; None if unknown.
        spends: Time until which a single-use token has to be remembered once `Admission.begin` has
            marked it as used, Unix time [s]; None without a single-use token.
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
    """Return the error that refuses or ends a session whose invitation ended too long ago."""
    return Denied("the session has ended with its invitation")


class Admission:
    """Decides which clients one server admits.

    Args:
        ring: Keys that verify tokens; None if the server uses no tokens.
        admits_anybody: Whether a client without a token may come in.
        single_use: Whether an invitation can be used only once.
        session_valid: Time that a session lasts after its invitation has ended [s]; None if a
            connected session has no end.
        draw: Function that returns a new random name that nobody can guess.
        keep: Function that stores the record of a used single-use token for later processes; None
            for no storage.

    Attributes:
        ring: As the argument; another key ring replaces it when keys are rotated.
        admits_anybody: As the argument.
        keep: As the argument; a server with a state file sets this attribute.
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
            # Tokens need cryptography libraries, whose import takes a tenth of a server's start.
            # A server without keys does not import them; a server with keys does so before
            # anybody comes.
            import_module("cohaptic_server.access.tokens")
        self.ring = ring
        self.admits_anybody = admits_anybody
        self._used = UsedTokens() if single_use else None
        self._session_valid = session_valid
        self._draw = draw
        self.keep = keep

    def recall(self, used: Used) -> None:
        """Mark a single-use token as used because an earlier process has accepted it."""
        if self._used is not None:
            self._used.recall(used.jti, used.ends)

    def admit(self, token: str | None, room: str, now: float) -> Guest:
        """Verify the token of a client, and return the guest whom the token identifies.

        A single-use token stays usable until `begin`.

        Args:
            token: Token of the first message; None without a token.
            room: Name of the room that the client wants to enter.
            now: Unix time [s].

        Raises:
            Denied: The client may not come in.
        """
        # A client may send its token to every server; a server without keys ignores the token.
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
        """Mark the single-use token of a guest as used, when the guest joins the room or its queue.

        Args:
            guest: Guest that `admit` returned.
            now: Unix time [s].
        """
        if self._used is None or guest.spends is None:
            return
        self._used.use(guest.invitation, guest.spends, now)
        if self.keep is not None:
            self.keep(Used(jti=guest.invitation, ends=guest.spends))

    def ends(self, guest: Guest) -> float:
        """Return when a connected guest has to leave, Unix time [s]; infinite for no end."""
        if self._session_valid is None or not guest.session:
            return float("inf")
        # `since` is a lower bound of the unknown end: apart from differences between clocks, the
        # invitation had not ended when the session began.
        until = guest.since if guest.until is None else guest.until
        return until + self._session_valid

    def session_token(self, guest: Guest, now: float) -> str | None:
        """Make the token with which a guest can come back.

        Returns:
            The token; None without keys, without a session, or if the session is over.
        """
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
