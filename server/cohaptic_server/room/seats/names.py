"""Whose a name is: a client makes a secret of its own, and comes back with it, or with its session.

A name in use goes only to who says its secret, at once. Without one it may be taken over
after a while of silence, from the same address. When a connection was lost, and not ended by either
side, its name is kept for who had it.

No two users may have names that look alike. A name has a skeleton, as in Unicode Technical Standard
39; names with the same one look alike. The table is a part of the standard's: letters of Cyrillic,
Greek and Armenian that are drawn as Latin ones in common fonts, digits and signs that are drawn as
letters, and dashes and apostrophes. Blanks do not count. Letters of one case that are drawn as
those of the other are told apart, and so are accents.
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
KEPT_FOR = 60.0  # s for which a name is kept; who is away for longer begins anew
# s for which a seat is kept as well. A client tries again every 0.5 s, and a path that has broken
# is back within ten seconds or so, or for a long time not.
SEAT_KEPT_FOR = 15.0
_MOST_KEPT = 64  # as many as the largest room has users


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim of one client to its name.

    Args:
        key: Its secret; None without one.
        source: Whom its connection is counted with.
        session: That the server has signed for it; empty without one.
    """

    key: str | None
    source: str
    session: str = ""

    @property
    def is_secret(self) -> bool:
        """Whether nobody else can make it."""
        return self.key is not None or self.session != ""

    def is_session_of(self, other: Claim) -> bool:
        """Whether both are of one session, which touches by one name at a time."""
        return self.session != "" and self.session == other.session

    def is_of(self, other: Claim) -> bool:
        """Whether both are the same client, as far as can be known."""
        if not self.is_secret:
            return self.source == other.source
        if self.is_session_of(other):
            return True
        mine, its = self.key, other.key
        return mine is not None and its is not None and hmac.compare_digest(mine, its)


def may_replace(holder: Claim, silence: float, other: Claim) -> bool:
    """Whether a client may take the place of one that is connected.

    Args:
        holder: Who has the name.
        silence: Since its last sample [s].
        other: Who wants it.
    """
    return holder.is_of(other) and (holder.is_secret or silence >= REPLACE_AFTER)


class KeptNames:
    """Names of clients whose connections were lost. It holds at most `_MOST_KEPT`."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[Claim, float]] = {}
        self._seats: dict[str, float] = {}  # until when [s]

    def keep(self, name: str, claim: Claim, now: float, *, since: float | None) -> None:
        """Keep a name for who had it, and for a while its seat.

        Args:
            name: Name of who was there.
            claim: To it.
            now: Time [s].
            since: When it took its seat [s]; None for one whose seat is not kept. It is kept for no
                longer than it was taken: who only comes and vanishes, by one name after another,
                would keep everybody out and be nowhere for an administrator to put it out.
        """
        self._seats.pop(name, None)
        if since is not None:
            self._seats[name] = now + min(SEAT_KEPT_FOR, now - since)
        self._kept.pop(name, None)
        self._kept[name] = (claim, now + KEPT_FOR)
        if len(self._kept) > _MOST_KEPT:
            # Of the address that has most: who fills the list loses its own names first.
            sources = Counter(whose.source for whose, _ in self._kept.values())
            ((most, _),) = sources.most_common(1)
            del self._kept[next(n for n, (whose, _) in self._kept.items() if whose.source == most)]

    def seats(self, now: float) -> int:
        """How many of them have a seat kept as well."""
        self._seats = {n: end for n, end in self._seats.items() if end > now and n in self._kept}
        return len(self._seats)

    def seats_of(self, name: str, claim: Claim, now: float) -> int:
        """How many of those seats are free for who comes back.

        Args:
            name: By which it comes.
            claim: To it.
            now: Time [s].
        """
        return sum(self._seats.get(own, now) > now for own in self._names_of(name, claim))

    def check(self, name: str, claim: Claim, now: float) -> None:
        """Raise RemoteProtocolError if a name, or one like it, is kept for somebody else."""
        for kept, (whose, until) in self._kept.items():
            # The system behind an address is trusted with what its lost connections had: a client
            # that was killed has forgotten its secret. It goes by the very name.
            trusted = whose.is_of(claim) or (name == kept and whose.source == claim.source)
            if now < until and looks_like(name, kept) and not trusted:
                left = f"{until - now:.0f} s left"
                limit = f"another one: its owner lost the connection and has {left}"
                raise RemoteProtocolError("name", name, limit, CloseCode.NAME_TAKEN)

    def forget(self, name: str, claim: Claim) -> None:
        """Keep a name no more, nor any other of its session: who had it is back."""
        for own in self._names_of(name, claim):
            del self._kept[own]

    def _names_of(self, name: str, claim: Claim) -> list[str]:
        kept = self._kept.items()
        return [n for n, (whose, _) in kept if n == name or claim.is_session_of(whose)]


# Each letter of the first line looks like the one below it.
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
    # Latin, and signs. A capital I, a one and a bar are drawn as a small l.
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


@lru_cache(maxsize=4096)  # of names of at most 32 characters: those of the room, and of the removed
def skeleton(name: str) -> str:
    """What a name looks like: the same for all that look alike."""
    plain = unicodedata.normalize("NFD", unicodedata.normalize("NFKC", name))
    drawn = "".join(plain.split()).translate(_MAP).replace("rn", "m")
    return unicodedata.normalize("NFD", drawn)


def looks_like(one: str, other: str) -> bool:
    """Whether one name can be taken for the other, which it may be."""
    return skeleton(one) == skeleton(other)
