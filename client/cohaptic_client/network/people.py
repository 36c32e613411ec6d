"""Who else touches, in the words in which news of them is told. No I/O."""

from __future__ import annotations

from cohaptic.protocol.messages import UserJoined, UserLeft, Welcome


class People:
    """The others of a room, as its messages tell of them.

    The same message tells of one who joins and of a new name. Numbers rise with each who comes, and
    a welcome has only the names of those who were there before.

    Args:
        welcome: That this client was given.
    """

    def __init__(self, welcome: Welcome) -> None:
        self._own = welcome.user
        self._before = list(welcome.users)  # who was there already, and has no number yet
        self._known: dict[int, str] = {}

    def news(self, event: UserJoined | UserLeft) -> str:
        """What to tell of a message."""
        return self._joined(event) if isinstance(event, UserJoined) else self._left(event)

    def _joined(self, event: UserJoined) -> str:
        before = self._known.get(event.user)
        self._known[event.user] = event.name
        if before is not None:
            return f"{before} is now called {event.name}"
        if event.user > self._own:
            return f"{event.name} joined"
        if len(self._before) == 1:
            return f"{self._before.pop()} is now called {event.name}"
        return f"somebody who was here before you is now called {event.name}"

    def _left(self, event: UserLeft) -> str:
        before = self._known.pop(event.user, event.name)
        for name in {before, event.name} & set(self._before):
            self._before.remove(name)
        return f"{event.name} left" + ("" if event.reason == "bye" else f": {event.reason}")
