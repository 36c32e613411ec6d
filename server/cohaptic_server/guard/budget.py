"""Token buckets. A bucket is the time at which it is full again: one number, which is replaced.

With rate r and burst b, whoever spends gets no more than b + r t within any time t. The clock is an
argument. Should it be set back, a bucket that could not be so empty counts as full: nobody is
locked out until the clock is again where it was.
"""

from __future__ import annotations

from dataclasses import dataclass

FULL = float("-inf")  # a bucket that nothing was taken from


@dataclass(frozen=True, slots=True)
class Budget:
    """Budget of one kind of thing.

    Args:
        rate: How many in the long run [1/s].
        burst: How many at once, after a pause.
    """

    rate: float
    burst: float

    def __str__(self) -> str:
        return f"{self.rate:g} a second and {self.burst:g} at once"


def spend(bucket: float, amount: float, budget: Budget, now: float) -> float | None:
    """The bucket without `amount` of its content; None if there is less in it.

    Args:
        bucket: When it is full again [s].
        amount: How many are wanted.
        budget: Budget of the bucket.
        now: Time [s].
    """
    empty = now + budget.burst / budget.rate
    if bucket < now:
        bucket = now
    elif bucket > empty + 1e-3 / budget.rate:
        bucket = now
    bucket += amount / budget.rate
    # A millionth of a token of slack, since what is left after rounding may lack as much.
    return bucket if bucket <= empty + 1e-6 / budget.rate else None


def wait(bucket: float, amount: float, budget: Budget, now: float) -> float:
    """How long until `amount` can be spent, which is at most the burst [s]."""
    missing = bucket - now
    if missing > (budget.burst + 1e-3) / budget.rate:
        return 0.0
    return max(0.0, missing - (budget.burst - amount) / budget.rate)
