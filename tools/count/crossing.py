"""Which modules a piece of work crosses, in the order in which it comes to them.

Python's profiler says of every call from which module into which it goes. A *return* is a pair of
modules of which the later one calls the earlier one: a place to which a reader has to go back.
"""

from __future__ import annotations

import sys
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType

OURS = (
    "cohaptic.", "cohaptic_client.", "cohaptic_drivers.", "cohaptic_ops.", "cohaptic_server.",
    "cohaptic_tools.", "cohaptic_uploads.",
)  # fmt: skip


@dataclass
class Crossing:
    """Modules and calls between them.

    Args:
        modules: In the order in which they were entered.
        calls: Pairs of caller and called, both of them ours and not the same.
    """

    modules: list[str] = field(default_factory=list[str])
    calls: set[tuple[str, str]] = field(default_factory=set[tuple[str, str]])

    @property
    def returns(self) -> list[tuple[str, str]]:
        """Calls of a module that was entered before the caller, sorted."""
        order = {name: k for k, name in enumerate(self.modules)}
        return sorted(pair for pair in self.calls if order[pair[1]] < order[pair[0]])

    def note(self, frame: FrameType) -> None:
        """Take note of a call."""
        name = _module(frame)
        if name is None:
            return
        if name not in self.modules:
            self.modules.append(name)
        caller = frame.f_back
        while caller is not None and _module(caller) is None:
            caller = caller.f_back
        above = None if caller is None else _module(caller)
        # Work that began before has callers that were never entered.
        if above is not None and above != name and above in self.modules:
            self.calls.add((above, name))


@contextmanager
def crossing() -> Generator[Crossing]:
    """Note which modules are crossed within the block, in this thread."""
    found = Crossing()

    def look(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            found.note(frame)

    sys.setprofile(look)
    try:
        yield found
    finally:
        sys.setprofile(None)


def _module(frame: FrameType) -> str | None:
    name = str(frame.f_globals.get("__name__", ""))
    # The body of a module that is imported is no step of the work.
    return name if name.startswith(OURS) and frame.f_code.co_name != "<module>" else None
