"""A law: contact with the damping of Hunt and Crossley (1975), which goes with the force.

    f = k x (1 + c v),    x the depth [m], v the speed into the surface [m/s]

A hand that taps loses energy as on flesh, and the force begins and ends with the contact.
"""

from __future__ import annotations

from cohaptic_client import Contact

LOSS = 1.5  # s/m; flesh gives back about 0.7 of the speed of a tap at 0.2 m/s


class HuntCrossley:
    """The law, with the stiffness of the object at the contact."""

    name = "hunt_crossley"
    reason = "a tap on flesh loses energy, more of it where the force is larger"
    is_law = True

    def begin(self) -> bool:
        """Return a memory: there is nothing to remember."""
        return True

    def apply(self, memory: bool, contact: Contact) -> bool:
        """Press."""
        pushed = 1.0 + LOSS * contact.speed_in
        contact.press(contact.k_h * contact.depth * pushed)
        # What the hand's own motion may change: by its place, and by its speed.
        contact.added_stiffness = contact.k_h * abs(pushed - 1.0)
        contact.added_damping = contact.k_h * contact.depth * LOSS
        return memory


RULE = HuntCrossley()
