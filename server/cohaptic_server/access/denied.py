"""The refusal of somebody who may not come in, or may not do what was asked."""

from __future__ import annotations

from cohaptic.errors import CloseCode, RemoteProtocolError

ASK = "ask the owner of the room for a new invitation"


class Denied(RemoteProtocolError):
    """What was wrong, and what to do; it tells neither the token nor a secret.

    Args:
        problem: What was wrong.
        advice: What the person can do.
        code: `UNAUTHENTICATED` where nobody knows who it is, `FORBIDDEN` where it may not.
    """

    def __init__(
        self, problem: str, advice: str = ASK, code: CloseCode = CloseCode.UNAUTHENTICATED
    ) -> None:
        super().__init__("token", problem, advice, code)

    def __str__(self) -> str:
        return f"{self.value}: {self.limit}"


def forbidden(problem: str, advice: str = ASK) -> Denied:
    """The refusal of somebody who is known and may not."""
    return Denied(problem, advice, CloseCode.FORBIDDEN)
