"""Token buckets; one number represents a bucket: the time at which it is full again [s].

With rate r and burst b, at most b + r t tokens can be spent within any time t. The time is an
argument. If the clock is set back, a bucket that seems emptier than possible counts as full, so
that nobody is locked out until the clock reaches the old time again.
"""

from __future__ import annotations

from dataclasses import dataclass

FULL = float("-inf")  # a bucket from which nothing was taken


@dataclass(frozen=True, slots=True)
class Budget:
    """Rate limit of one kind of request.

    Args:
        rate: Long-term rate [1/s].
        burst: Number at once after a pause.
    """

    rate: float
    burst: float

    def __str__(self) -> str:
        return f"{self.rate:g} a second and {self.burst:g} at once"


def spend(bucket: float, amount: float, budget: Budget, now: float) -> float | None:
    """Bucket after `amount` tokens are taken out; None if it contains fewer tokens.

    Args:
        bucket: Time at which the bucket is full again [s].
        amount: Number of tokens wanted.
        now: Time [s].
    """
    empty = now + budget.burst / budget.rate
    if bucket < now:
        bucket = now
    elif bucket > empty + 1e-3 / budget.rate:
        bucket = now
    bucket += amount / budget.rate
    # A slack of a millionth of a token, since rounding may reduce the content by that much.
    return bucket if bucket <= empty + 1e-6 / budget.rate else None


def wait(bucket: float, amount: float, budget: Budget, now: float) -> float:
    """Time until `amount` tokens, at most the burst, can be spent [s]."""
    missing = bucket - now
    if missing > (budget.burst + 1e-3) / budget.rate:
        return 0.0
    return max(0.0, missing - (budget.burst - amount) / budget.rate)
