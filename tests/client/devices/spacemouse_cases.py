"""A SpaceMouse without hardware, and reports of one."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Iterable

from hypothesis import strategies as st

from cohaptic.vec import Vec3
from cohaptic_client.devices.spacemouse import SpaceMouse

CENTER: Vec3 = (0.1, -0.2, 0.3)
REACH = 0.05
MAX_SPEED = 0.15
MAX_GAP = 0.02  # s; the driver's, which is also when the safety layer calls the loop stalled
SILENCE = 0.2  # s without a report, after which a deflected cap counts as gone
PERIOD = 0.001
ROUNDING = 1e-12  # m; a cube of decimetres, added to in doubles
int16s = st.integers(-(2**15), 2**15 - 1)
counts = st.tuples(int16s, int16s, int16s)
fractions = st.floats(-1.0, 1.0)


def report(kind: int, *values: int) -> list[int]:
    return list(struct.pack(f"<B{len(values)}h", kind, *values))


class FakeTransport:
    def __init__(self, reports: Iterable[list[int]] = ()) -> None:
        self.reports = deque(reports)
        self.plugged = True
        self.closed = 0

    def read(self, max_length: int, /) -> list[int]:
        if not self.plugged:
            raise OSError("read error")
        return self.reports.popleft()[:max_length] if self.reports else []

    def close(self) -> None:
        self.closed += 1


def mouse_on(transport: FakeTransport, reach: float = REACH) -> SpaceMouse:
    return SpaceMouse(transport, CENTER, reach=reach, max_speed=MAX_SPEED)


short_report = st.builds(report, st.integers(0, 4), int16s, int16s, int16s)
any_report = st.one_of(
    st.binary(max_size=20).map(list),
    short_report,
    counts.map(lambda c: report(1, *c, *c)),
)
