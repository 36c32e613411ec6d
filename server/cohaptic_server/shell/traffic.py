"""What came, went and was turned away at one server, counted since its start."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from cohaptic.errors import CloseCode

_CAUSES = {code.value: code.name.lower() for code in CloseCode}
# Of the library and ours; neither tells of a refusal.
_PEACEFUL = (1000, 1001, CloseCode.SERVER_STOPS.value, CloseCode.OBJECT_CHANGED.value)


@dataclass(slots=True)
class Traffic:
    """Counters of one process. Their keys are this program's words, never a peer's.

    Attributes:
        received: Bytes of all connections, after TLS.
        sent: Bytes of messages and of the bodies of responses, before TLS.
        refused: Sessions that the server has closed, and requests that it has not served, by cause.
        spent: Connections that were closed because a budget was spent, by budget.
    """

    received: int = 0
    sent: int = 0
    refused: Counter[str] = field(default_factory=Counter[str])
    spent: Counter[str] = field(default_factory=Counter[str])

    def end(self, close: tuple[int, str] | None) -> None:
        """Count the end of a session, if the server has closed it for a reason.

        Args:
            close: Code and reason; None if the peer has gone by itself.
        """
        if close is not None and close[0] not in _PEACEFUL:
            self.refused[_CAUSES.get(close[0], "other")] += 1
