"""Why a force was held back or taken away: the column `reason` of a recorded row, as an integer.

The lowest byte has a flag for each of what may hold at once, and the rest the cause of a fault. The
loop writes it, and `cohaptic why` reads it.
"""

from __future__ import annotations

from typing import Final

SILENT: Final = 1
WAITING: Final = 2
RELEASED: Final = 4
SLIPS: Final = 8
CATCHES_UP: Final = 16
LAW_CHANGES: Final = 32

FLAGS: Final = {
    SILENT: "the server is silent",
    WAITING: "the hand is not engaged yet",
    RELEASED: "the force is taken away",
    SLIPS: "the finger slips",
    CATCHES_UP: "the force follows what the hand did while the loop stood still",
    LAW_CHANGES: "the law changes",
}

OUT_OF_REACH: Final = 1
JUMPED: Final = 2
LAW_FAILED: Final = 3
NO_NUMBER: Final = 4
TOO_FAST: Final = 5
STALLED: Final = 6
LET_GO: Final = 7
OUTSIDE: Final = 8
RULE_FAILED: Final = 9

CAUSES: Final = {
    OUT_OF_REACH: "the device said a place that is out of reach",
    JUMPED: "the tip jumped, faster than a hand moves",
    LAW_FAILED: "the law failed",
    NO_NUMBER: "the law asked for a force that is not a number",
    TOO_FAST: "the hand moved too fast",
    STALLED: "the loop stood still for too long",
    LET_GO: "the switch of the device is not held",
    RULE_FAILED: "a rule of another package failed",
    OUTSIDE: "the loop was held up, or a fault of before was not acknowledged",
}

_BITS: Final = 8  # of the flags; the cause is above them


def reason_of(flags: int, cause: int) -> float:
    """Return the number for a row.

    Args:
        flags: Sum of the flags that hold.
        cause: Cause of a fault; 0 for none.
    """
    return float(flags | cause << _BITS)


def flags_in(reason: float) -> list[str]:
    """Return what holds, in words."""
    return [words for flag, words in FLAGS.items() if int(reason) & flag]


def cause_in(reason: float) -> str:
    """Return the cause of a fault in words; empty for none."""
    return CAUSES.get(int(reason) >> _BITS, "")
