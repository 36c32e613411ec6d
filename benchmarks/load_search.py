"""The most users that a server serves in time, by as few tries as its precision asks for."""

from __future__ import annotations

from collections.abc import Callable

FACTOR = 1.5  # between two tries until one holds and one does not


def largest(
    holds: Callable[[int], bool], start: int, limit: int, precision: float
) -> tuple[int, int | None]:
    """The most that holds, and the fewest found that do not.

    It is taken that fewer hold where more do. First it goes up or down from the start by `FACTOR`,
    then between the two by halves.

    Args:
        holds: Whether so many do.
        start: The first try.
        limit: The most to be tried.
        precision: How far apart the two may be in the end, relative to the first.

    Returns:
        The most that holds, 0 if one user is too many; and the fewest that do not, None if the
        limit holds.
    """
    low, tried = 0, min(max(1, start), limit)
    high: int | None = None
    while low < limit and (high is None or high - low > max(1, int(precision * low))):
        if holds(tried):
            low = tried
        else:
            high = tried
        if high is None:
            tried = min(limit, max(low + 1, int(FACTOR * low)))
        elif low == 0:
            tried = max(1, int(high / FACTOR))
        else:
            tried = (low + high) // 2
    return low, high
