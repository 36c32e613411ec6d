"""A limit: the force falls where the tip comes near the edge of the device's workspace.

At the edge a device cannot give its force any more, or gives it in another direction.
"""

from __future__ import annotations

import math

from cohaptic_client import Contact

RADIUS = 0.12  # m; of a workspace that is a ball about the origin
MARGIN = 0.02  # m, over which the force falls to nothing


class Edge:
    """The limit."""

    name = "edge"
    reason = "a device at the edge of its workspace gives no force, or a wrong one"
    is_law = False

    def begin(self) -> bool:
        """Return a memory: there is nothing to remember."""
        return True

    def apply(self, memory: bool, contact: Contact) -> bool:
        """Give the share of the force that the place allows."""
        fraction = min(1.0, max(0.0, (RADIUS - math.hypot(*contact.tip)) / MARGIN))
        if fraction < 1.0:
            x, y, z = contact.force
            contact.added_stiffness = math.hypot(x, y, z) / MARGIN
            contact.force = (fraction * x, fraction * y, fraction * z)
        return memory


RULE = Edge()
