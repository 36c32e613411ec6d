"""Who follows whose view, found from either side without a search: a room has a thousand pages."""

from __future__ import annotations

from collections.abc import Collection

from cohaptic_server.room.company.visitor import Visitor


class Follows:
    """Of one room; the only one who sets `Visitor.following` and `Visitor.user`."""

    def __init__(self) -> None:
        self._followers: dict[int, dict[Visitor, None]] = {}  # by user, in the order they came
        self._pages: dict[int, Visitor] = {}

    @property
    def users(self) -> tuple[int, ...]:
        """Users who are followed by somebody."""
        return tuple(self._followers)

    @property
    def pages(self) -> Collection[Visitor]:
        """Pages that have a hand."""
        return self._pages.values()

    def of(self, user: int) -> tuple[Visitor, ...]:
        """Who follows a user; nobody follows 0."""
        return tuple(self._followers.get(user, ()))

    def count(self, user: int) -> int:
        """How many follow it."""
        return len(self._followers.get(user, ()))

    def page(self, user: int) -> Visitor | None:
        """The page that speaks for a user's hand."""
        return self._pages.get(user)

    def follow(self, visitor: Visitor, user: int) -> None:
        """Let a page follow a user, and nobody any more with 0."""
        before = self._followers.get(visitor.following)
        if before is not None:
            before.pop(visitor, None)
            if not before:
                del self._followers[visitor.following]
        visitor.following = user
        if user:
            self._followers.setdefault(user, {})[visitor] = None

    def take_hand(self, visitor: Visitor, user: int) -> Visitor | None:
        """Let a page speak for a hand, and for none with 0.

        Returns:
            The page that spoke for it before, and has none any more.
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
        """Forget a page that has gone."""
        self.follow(visitor, 0)
        self.take_hand(visitor, 0)
