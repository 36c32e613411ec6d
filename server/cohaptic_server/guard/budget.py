"""Token buckets for rate limits; a bucket is one number: the time at which it is full again [s].

With rate r and burst b, at most b + r t tokens can be spent within any time t. The current time is
an argument. If the clock was set back, a bucket may seem emptier than possible; such a bucket
counts as full, so that nobody is locked out until the clock reaches the old time again.
"""

from __future__ import annotations

from dataclasses import dataclass

FULL = float("-inf")  # a bucket from which nothing was taken


@dataclass(frozen=True, slots=True)
class Budget:
    """Rate limit of one kind of request.

    Args:
        rate: Long-term rate [1/s].
        burst: Number of requests that may come at once after a pause.
    """

    rate: float
    burst: float

    def __str__(self) -> str:
        return f"{self.rate:g} a second and {self.burst:g} at once"


def spend(bucket: float, amount: float, budget: Budget, now: float) -> float | None:
    """Take `amount` tokens out of a bucket; returns the bucket, or None if it has fewer tokens.

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
