"""Error that refuses entry to a client, or an action that the client's grants do not allow."""

from __future__ import annotations

from cohaptic.errors import CloseCode, RemoteProtocolError

ASK = "ask the owner of the room for a new invitation"


class Denied(RemoteProtocolError):
    """Refusal with a reason and advice; its text contains neither the token nor a secret.

    Args:
        problem: Reason of the refusal.
        advice: Action that the person can take.
        code: `UNAUTHENTICATED` if the client is unknown, `FORBIDDEN` if the client is known but
            lacks the right.
    """

    def __init__(
        self, problem: str, advice: str = ASK, code: CloseCode = CloseCode.UNAUTHENTICATED
    ) -> None:
        super().__init__("token", problem, advice, code)

    def __str__(self) -> str:
        return f"{self.value}: {self.limit}"


def forbidden(problem: str, advice: str = ASK) -> Denied:
    """Refusal of a client whose identity is known but who lacks the right."""
    return Denied(problem, advice, CloseCode.FORBIDDEN)
