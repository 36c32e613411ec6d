"""The record of one haptic period: a row of numbers with named columns."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

from cohaptic.vec import Vec3


class Row(NamedTuple):
    """Record of one haptic period of a client.

    Fields:
        t: Time on the client's clock [s].
        x, y, z: Position of the probe [m].
        fx, fy, fz: Force given to the device [N].
        wanted: Normal force that the law computed, before the safety layer [N].
        felt_from_others: Part of the force that the other users' contacts cause [N].
        u_others: Displacement of the contact point by the other users, along the normal [m].
        indentation: Indentation of the surface under the probe by this hand's force [m].
        k_h: Gain of the law [N/m].
        damping: Force of the passivity layer, along the normal [N].
        k_o: Stiffness of the object at the contact [N/m].
        level: Intended position of a simulated hand, from 0 (off the surface) to 1 (pressed).
        scale: Factor by which the safety layer multiplies the force; 1 for the full force.
        late: Delay with which the period started [s].
        tick: Simulation tick of the patch in use.
        patch_age: Time since the client received that patch [s].
        lag: Time constant with which the object answers other users' forces (the room's lag) [s].
        along: Tangential force of friction [N].
        fault: 1 while a fault keeps the force off; 2 if it stays off until the user acknowledges
            the fault.
        by_surface ... by_rate: What each rule did to the force; together they are its size [N].
            Surface, models, gain, depth, law, friction, limit, fade and rate, as in
            `cohaptic_client.loop.ledger`; that of the damping is `damping`.
        held_turn: What is held back of a turn of the force, at a right angle to it [N].
        spent_gain ... spent_depth: What rules took of the budget for changes of the force that the
            hand's own motion does not cause [N].
        budget: That budget at the beginning of the period [N].
        on_body: Size of the force whose opposite the body is to carry [N].
        carried: Size of the one that it carried at the tick of the newest patch [N].
        tick_presence ... tick_rate: What the server's tick made of the force that it had heard
            of, at the tick of the newest patch, as in `cohaptic.control.tick_ledger` [N].
        gain_cut: What the law's gain is less, at that tick, since others' models stiffen the
            contact [N/m].
        reason: Why the force is held back, as in `cohaptic.status.reason`.
        by_rule_1 ... by_rule_4: What rules of other packages added [N]; a recording has their names
            in place of the numbers.
    """

    t: float
    x: float
    y: float
    z: float
    fx: float
    fy: float
    fz: float
    wanted: float
    felt_from_others: float
    u_others: float
    indentation: float
    k_h: float
    damping: float
    k_o: float
    level: float
    scale: float
    late: float
    tick: float
    patch_age: float
    lag: float
    along: float = 0.0
    fault: float = 0.0
    by_surface: float = 0.0
    by_models: float = 0.0
    by_gain: float = 0.0
    by_depth: float = 0.0
    by_law: float = 0.0
    by_friction: float = 0.0
    by_limit: float = 0.0
    by_fade: float = 0.0
    by_rate: float = 0.0
    held_turn: float = 0.0
    spent_gain: float = 0.0
    spent_fades: float = 0.0
    spent_turn: float = 0.0
    spent_models: float = 0.0
    spent_depth: float = 0.0
    budget: float = 0.0
    on_body: float = 0.0
    carried: float = 0.0
    tick_presence: float = 0.0
    tick_limit: float = 0.0
    tick_anticipation: float = 0.0
    tick_lag: float = 0.0
    tick_rate: float = 0.0
    gain_cut: float = 0.0
    reason: float = 0.0
    by_rule_1: float = 0.0
    by_rule_2: float = 0.0
    by_rule_3: float = 0.0
    by_rule_4: float = 0.0

    @property
    def tip(self) -> Vec3:
        """Position of the probe, shape (3,) [m]."""
        return (self.x, self.y, self.z)

    @property
    def force(self) -> Vec3:
        """Force given to the device, shape (3,) [N]."""
        return (self.fx, self.fy, self.fz)


COLUMNS = Row._fields
# Columns that 32 bits do not hold: a clock's time of days to the microsecond, ticks above 2^24,
# and bits. The others are measured or computed to fewer digits than the 7 of 32 bits.
EXACT = frozenset({"t", "tick", "reason"})
ROW = struct.Struct(f"<{len(COLUMNS)}d")  # a row in memory: 64-bit numbers in the order of `Row`


MAX_RULES = 4  # of other packages, of which a row has what they did


def columns_with(rules: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the columns with rules of other packages, by their names."""
    numbered = {f"by_rule_{i}": f"by_{name}" for i, name in enumerate(rules, start=1)}
    return tuple(numbered.get(name, name) for name in COLUMNS)


_ACTED = 1e-3  # N; what did less is left out of a report


def acted_in(row: Row, rules: Sequence[str] = ()) -> dict[str, float]:
    """Return what acted on the force of a period, by name [N].

    Args:
        row: Record of the period.
        rules: Names of the rules of other packages in it.

    Returns:
        The entries of the ledger without `by_`, which together are the size of the force; and those
        of the server's tick, which begin with `tick_`.
    """
    found = dict[str, float]()
    for column, value in zip(columns_with(rules), row, strict=True):
        if column.startswith(("by_", "tick_")) or column == "damping":
            if abs(value) >= _ACTED:
                found[column.removeprefix("by_")] = value
    return found


def rows_in(block: bytes) -> list[Row]:
    """Unpack the rows in a block of bytes, which `ROW` packed one behind the other."""
    return [Row._make(values) for values in ROW.iter_unpack(block)]


def last_row(block: bytes) -> Row:
    """Return the newest row of a block of bytes that has at least one row."""
    return Row._make(ROW.unpack_from(block, len(block) - ROW.size))
