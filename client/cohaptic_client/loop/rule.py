"""A rule: one thing that happens to a force in a period."""

from __future__ import annotations

from typing import Final

from cohaptic_client.loop.period import Period


class RuleError(ValueError):
    """A rule of another package failed; the text names it."""


class Rule:
    """One rule of the chain.

    Fields:
        name: Name of the rule, as ledger and documents have it.
        constant: Name of the constant with which it works, and its unit; empty for none.
        reason: What it does and why, in a sentence.
    """

    name: Final[str]
    constant: Final[str]
    reason: Final[str]

    def __init__(self, name: str, reason: str, constant: str = "") -> None:
        self.name = name
        self.reason = reason
        self.constant = constant

    def apply(self, period: Period) -> None:
        """Do to the period what the rule does."""
        raise NotImplementedError(self.name)
