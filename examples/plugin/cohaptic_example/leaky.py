"""A law in place of `pi`: its integral leaks, so that a hand that rests for long is let down.

    f = K_h x + s,    ds/dt = I x - s / T,    x the depth that the surface has not followed yet [m]

With `pi` the depth is that below the surface with the hand's own dent, which comes back a round
trip late: the integral brings it to zero at rest. The server chooses K_h and I for that loop.
"""

from __future__ import annotations

from cohaptic_client import Contact

LEAK = 5.0  # s; time in which the integral's force falls to a third
RELEASE = 0.1  # s; time in which it falls to zero after contact


class Leaky:
    """The law; its memory is the integral's force [N], and the last force in contact [N]."""

    name = "leaky"
    reason = "an integral that forgets: a hand that rests for long is let down"
    is_law = True
    in_place_of = "pi"

    def begin(self) -> tuple[float, float]:
        """Return the memory of a hand without contact."""
        return 0.0, 0.0

    def apply(self, memory: tuple[float, float], contact: Contact) -> tuple[float, float]:
        """Press, and no further ahead of the hand than the budget allows."""
        integral, touched = memory
        if contact.depth > 0.0:
            wanted = contact.integral_gain * contact.depth - integral / LEAK
        else:
            wanted = -touched / RELEASE
        limit = contact.budget  # what the hand's own motion does not explain, in this period
        grown = max(-limit, min(limit, wanted * contact.dt))
        integral = max(0.0, integral + grown)
        contact.press(contact.k_h * contact.depth + integral)
        return integral, integral if contact.depth > 0.0 else touched


RULE = Leaky()
