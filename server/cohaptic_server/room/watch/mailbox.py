"""State for one page that is not a scene: newer news takes the place of older news that waits.

Whoever reads slowly hears less, and never something that is no longer so; what waits is bounded.
"""

from __future__ import annotations

MOST_POINTED = 16  # people whose newest place waits; who pointed first is left out first


class Mailbox:
    """Encoded messages of `control/company.py` that wait for one watcher."""

    def __init__(self) -> None:
        self._company: str | None = None
        self._aimed: str | None = None
        self._pointed: dict[object, str] = {}

    def put_company(self, text: str) -> None:
        """Who is here now."""
        self._company = text

    def put_aimed(self, text: str) -> None:
        """From where the one who is followed looks now."""
        self._aimed = text

    def put_pointed(self, who: object, text: str) -> None:
        """At what somebody points now."""
        self._pointed.pop(who, None)
        self._pointed[who] = text
        while len(self._pointed) > MOST_POINTED:
            self._pointed.pop(next(iter(self._pointed)))

    def take(self) -> list[str]:
        """Remove and return what waits: who is here first, since the rest is about them."""
        waits = [text for text in (self._company, self._aimed) if text is not None]
        waits += self._pointed.values()
        self._company = self._aimed = None
        self._pointed.clear()
        return waits
