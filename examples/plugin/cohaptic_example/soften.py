"""A filter: the force passes a low-pass, for hands that tremble."""

from __future__ import annotations

import math

from cohaptic_client import Contact

TIME = 0.02  # s; time constant, 8 Hz

Force = tuple[float, float, float]


class Soften:
    """The filter; its memory is the force that it gave last."""

    name = "soften"
    reason = "what a hand trembles at 8 Hz and above is felt less"
    is_law = False

    def begin(self) -> Force:
        """Return no force."""
        return (0.0, 0.0, 0.0)

    def apply(self, memory: Force, contact: Contact) -> Force:
        """Follow the force."""
        way = 1.0 - math.exp(-contact.dt / TIME)
        x, y, z = (a + way * (b - a) for a, b in zip(memory, contact.force, strict=True))
        contact.force = (x, y, z)
        return contact.force


RULE = Soften()
