"""New patches from the shared memory to the loop, a part of the work in each period.

Code and data of an arrival are used once in a simulation period, and the processor has them in no
cache: all of it in one period would make that three times as long as the others. What is begun is
finished before the next one is begun, so that patches as frequent as periods starve none.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cohaptic.control.mesh_surface import Surface
from cohaptic.protocol.patch import Patch
from cohaptic_client.loop.memory import Slot


class Intake:
    """Reads, then makes the surface of a mesh patch, then hands over: one of these in each period.

    A plane or sphere comes into use one period after the loop has seen it, a mesh patch two.

    Args:
        slot: With the newest frame. The network process has decoded it before, and refused what is
            wrong.
        make: The surface of a patch.

    Attributes:
        patch: To be used in this period, with `surface`.
        surface: Of that patch.
    """

    def __init__(self, slot: Slot, make: Callable[[Patch], Surface]) -> None:
        self._slot: Final = slot
        self._make: Final = make
        self._begun: Patch | None = None
        self.patch: Patch | None = None
        self.surface: Surface | None = None

    def advance(self) -> bool:
        """Do the part of this period; returns whether a patch is to be used in it."""
        patch = self._begun
        if patch is None:
            frame = self._slot.read()
            if frame is not None:
                self._begun = Patch.decode_checked(frame)
            return False
        if self.patch is not patch:
            self.patch, self.surface = patch, self._make(patch)
            if patch.neighbourhood is not None:
                return False
        self._begun = None
        return True
