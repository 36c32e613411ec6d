"""Step 5: a controller of your own is a rule of the haptic loop.

python examples/step_5_own_controller.py

This law is a spring and a damper on the surface that the server sends. Limits, fades and the budget
of changes stay behind it, whatever it does. `hand.why` names it beside the other rules.
"""

from __future__ import annotations

import time

from cohaptic_client import Contact, joined
from cohaptic_server import serve


class SpringDamper:
    """Contact by a spring of the server's gain, and damping while the hand goes in."""

    name = "spring_damper"
    reason = "the law of step 5"
    is_law = True  # in place of ours; a rule that is no law changes the force behind it
    damping = 5.0  # N s/m

    def begin(self) -> float:
        """Return the memory of the first period: the largest force so far [N]."""
        return 0.0

    def apply(self, memory: float, contact: Contact) -> float:
        """Press in one period; return the memory of the next."""
        if contact.depth <= 0.0:
            return memory
        # What makes the force depend on speed is said, so that the limits allow for it.
        contact.added_damping = self.damping
        force = contact.k_h * contact.depth + self.damping * max(0.0, contact.speed_in)
        contact.press(force)
        return max(memory, force)


with (
    serve("balloon", port=0) as room,
    joined(room.url, name="ann", rules=[SpringDamper()]) as hand,
):
    x, y, z = hand.body.center
    hand.move_to((x + hand.body.radius - 0.01, y, z), seconds=1.0)
    time.sleep(0.9)
    print(f"on its way: {hand.why.sentence}")
    time.sleep(1.5)
    print(f"at rest:    {hand.why.sentence}")
