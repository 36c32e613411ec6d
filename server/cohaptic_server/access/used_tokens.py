"""Which tokens were used, where each may be used once; the memory is bounded."""

from __future__ import annotations

from cohaptic_server.access.denied import Denied
from cohaptic_server.access.remembered import MOST_USED


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
