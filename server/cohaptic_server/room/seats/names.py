"""Ownership of names: a client proves by its secret or its session that a name is its own.

A client with the secret or the session of a connected client with this name replaces that client at
once. If the connected client has neither, a client at the same address may replace it after
`REPLACE_AFTER` without a sample. When a connection breaks, the name is
reserved for its owner, unless client or server ended the session before.

No two users may have names that look alike. A name has a skeleton, as in Unicode Technical Standard
39; names with the same skeleton look alike. The table is a part of the standard's table: Cyrillic,
Greek and Armenian letters that common fonts draw like Latin letters, digits and signs that look
like letters, and dashes and apostrophes. Blanks do not count. Letters of one case that look like
letters of the other case stay different, and so do accented letters.
"""
# ruff: noqa: RUF001 (letters that can be taken for others are the matter here)

from __future__ import annotations

import hmac
import unicodedata
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache

from cohaptic.errors import CloseCode, RemoteProtocolError

REPLACE_AFTER = 2.0  # s without a sample, after which a name without a secret may be taken over
KEPT_FOR = 60.0  # s for which a name is reserved; a client that is away for longer begins anew
# s for which a seat is reserved as well. A client tries again every 0.5 s, and a broken path is
# back either within ten seconds or so, or only after a long time.
SEAT_KEPT_FOR = 15.0
_MAX_KEPT = 64  # as many as the largest room has users


@dataclass(frozen=True, slots=True)
class Claim:
    """Data by which one client shows that a name is its own.

    Args:
        key: Secret of the client; None without a secret.
        source: Network address of the client's connection.
        session: Identifier of the session in the token that the server has signed; empty without
            one.
    """

    key: str | None
    source: str
    session: str = ""

    @property
    def is_secret(self) -> bool:
        """Whether the claim has a secret or a session, so that no other client can make it."""
        return self.key is not None or self.session != ""

    def is_session_of(self, other: Claim) -> bool:
        """Whether both claims belong to the same session; a session has one name at a time."""
        return self.session != "" and self.session == other.session

    def is_of(self, other: Claim) -> bool:
        """Whether both claims belong to the same client, as far as the server can know."""
        if not self.is_secret:
            return self.source == other.source
        if self.is_session_of(other):
            return True
        mine, its = self.key, other.key
        return mine is not None and its is not None and hmac.compare_digest(mine, its)


def may_replace(holder: Claim, silence: float, other: Claim) -> bool:
    """Whether a client may take the name and the seat of a connected client.

    Args:
        holder: Claim of the connected client, which has the name.
        silence: Time since the last sample of the connected client [s].
        other: Claim of the client that wants the name.
    """
    return holder.is_of(other) and (holder.is_secret or silence >= REPLACE_AFTER)


def may_take_kept(holder: Claim, other: Claim, *, same_name: bool) -> bool:
    """Whether a client may take the kept name, and the kept seat, of a lost connection.

    Args:
        holder: Claim of the client whose connection was lost.
        other: Claim of the client that wants the name.
        same_name: Whether the client asks for exactly the kept name. Then its address is enough,
            since a client that was killed has forgotten its secret.
    """
    return holder.is_of(other) or (same_name and holder.source == other.source)


class KeptNames:
    """Names that are reserved for clients whose connections were lost, at most `_MAX_KEPT`."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[Claim, float]] = {}
        self._seats: dict[str, float] = {}  # time until which the seat of each name is kept [s]

    def keep(self, name: str, claim: Claim, now: float, *, since: float | None) -> None:
        """Reserve a name for its owner, and for a shorter time the owner's seat.

        Args:
            name: Name of the client whose connection was lost.
            claim: Claim of that client to the name.
            now: Time [s].
            since: Time at which the client took its seat [s]; None if the seat is not reserved. A
                seat is reserved no longer than the client had it: otherwise a client that comes and
                vanishes under one name after another would keep everybody out, and an administrator
                would find nobody to remove.
        """
        self._seats.pop(name, None)
        if since is not None:
            self._seats[name] = now + min(SEAT_KEPT_FOR, now - since)
        self._kept.pop(name, None)
        self._kept[name] = (claim, now + KEPT_FOR)
        if len(self._kept) > _MAX_KEPT:
            # Drop the oldest name of the address with the most names, so that an address that
            # fills the list loses its own names first.
            sources = Counter(whose.source for whose, _ in self._kept.values())
            ((limit, _),) = sources.most_common(1)
            del self._kept[next(n for n, (whose, _) in self._kept.items() if whose.source == limit)]

    def seats(self, now: float) -> int:
        """Return the number of reserved seats, whose names are reserved as well."""
        self._seats = {n: end for n, end in self._seats.items() if end > now and n in self._kept}
        return len(self._seats)

    def seats_of(self, name: str, claim: Claim, now: float) -> int:
        """Return the number of reserved seats that belong to a client that comes back.

        Args:
            name: Name that the client comes back with.
            claim: Claim of the client to the name.
            now: Time [s].
        """
        return sum(self._seats.get(own, now) > now for own in self._names_of(name, claim))

    def check(self, name: str, claim: Claim, now: float) -> None:
        """Raise RemoteProtocolError if a name, or a similar one, is reserved for another client."""
        for kept, (whose, until) in self._kept.items():
            own = may_take_kept(whose, claim, same_name=name == kept)
            if now < until and looks_like(name, kept) and not own:
                limit = (
                    f"another one: kept for {until - now:.0f} s for one whose connection is lost"
                )
                raise RemoteProtocolError("name", name, limit, CloseCode.NAME_TAKEN)

    def forget(self, name: str, claim: Claim) -> None:
        """End the reservation of a name, and of all names of the claim's session.

        The room calls this when the owner is back.
        """
        for own in self._names_of(name, claim):
            del self._kept[own]

    def _names_of(self, name: str, claim: Claim) -> list[str]:
        kept = self._kept.items()
        return [n for n, (whose, _) in kept if n == name or claim.is_session_of(whose)]


# In each pair of lines, a letter of the first line looks like the letter below it.
_ALIKE = (
    # Cyrillic
    "аеорсухіјѕһԁԛԝѵӏАВЕКМНОРСТХУІЈЅԌԚԜѴӀ",
    "aeopcyxijshdqwvlABEKMHOPCTXYlJSGQWVl",
    # Greek
    "αοσνρυιγχκΑΒΕΖΗΙΚΜΝΟΡΤΥΧϳϲ",
    "aoovpuiyxkABEZHlKMNOPTYXjc",
    # Armenian
    "ոսօհցզՕՍԼ",
    "nuohgqOUL",
    # Latin letters and signs. A capital I, a one and a bar look like a small l.
    "ıɑɡǀI1|0",
    "iaglllll",
    "‐‒–—−‘’ʼʹ`",
    "-----'''''",
)
_MAP = {
    ord(theirs): ours
    for looks, like in zip(_ALIKE[::2], _ALIKE[1::2], strict=True)
    for theirs, ours in zip(looks, like, strict=True)
} | {ord("0"): "O"}


@lru_cache(maxsize=4096)  # names of the room and of removed users, at most 32 characters each
def skeleton(name: str) -> str:
    """Return the skeleton of a name, which is the same for all names that look alike."""
    plain = unicodedata.normalize("NFD", unicodedata.normalize("NFKC", name))
    drawn = "".join(plain.split()).translate(_MAP).replace("rn", "m")
    return unicodedata.normalize("NFD", drawn)


def looks_like(one: str, other: str) -> bool:
    """Whether two names are equal or can be mistaken for each other."""
    return skeleton(one) == skeleton(other)
