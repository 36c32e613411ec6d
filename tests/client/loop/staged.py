"""Hands on a plane, staged so that one rule of the loop acts, and recorded as the loop records."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from cohaptic.protocol.patch import Patch
from cohaptic.recording.recorder import Recorder
from cohaptic.recording.why import Columns
from cohaptic.status.row import ROW, columns_with
from cohaptic.vec import Vec3, scale, sub
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.added import Added
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.chain import CHAIN
from cohaptic_client.loop.rows import row_of
from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.safety import SafetyLimits
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import PERIOD, TICK
from tests.client.plane import PLANE

DEPTH = 0.008  # m
SETTLED = 1.5  # s in which a hand is engaged and its force has come
TICKS = round(TICK / PERIOD)  # periods from patch to patch

# The patch of a tick, from the one before, and the force whose opposite the body is to carry.
Server = Callable[[Patch, Vec3], Patch]


def honest(patch: Patch, on_body: Vec3) -> Patch:
    """The same plane, which carries what it is to carry."""
    return replace(patch, own_force=on_body)


class Stage:
    """A hand that presses on a plane; no network, and all rows kept.

    Args:
        settings: Settings of the loop; those of a usual hand unless others are given.
        chain: Rules of the loop.
    """

    def __init__(
        self, settings: LoopSettings | None = None, chain: tuple[Rule, ...] = CHAIN
    ) -> None:
        self.chain = chain
        self.names = [rule.name for rule in chain if isinstance(rule, Added)]
        self.settings = settings or LoopSettings(TICK, SafetyLimits(), max_damping=8.0)
        self.state = LoopState()
        self.now = 10.0
        self.tip: Vec3 = (0.0, 0.0, 0.002)
        self.server: Server | None = honest
        self.on_body: Vec3 = (0.0, 0.0, 0.0)
        self._patch = PLANE
        self._periods = 0
        self._rows = list[tuple[float, ...]]()

    def period(self, tip: Vec3, dt: float = PERIOD) -> None:
        """Play one period in which the tip has come to a place."""
        velocity = scale(sub(tip, self.tip), 1.0 / dt)
        self.now, self.tip = self.now + dt, tip
        if self.server is not None and self._periods % TICKS == 0:
            self._patch = replace(
                self.server(self._patch, self.on_body),
                tick=self._patch.tick + 1, t_server=self.now,
            )  # fmt: skip
            self.state = receive(self.state, self._patch, self.now, self.settings)
        self._periods += 1
        sample = DeviceSample(tip, velocity)
        self.state, self.last = step(self.state, sample, self.now, self.settings, self.chain)
        self.on_body = self.last.on_body
        self._rows.append(row_of(self.state, sample, self.last, self.now, 0.0))

    def rest(self, seconds: float) -> None:
        """Hold the tip where it is."""
        for _ in range(round(seconds / PERIOD)):
            self.period(self.tip)

    def go(self, to: Vec3, seconds: float) -> None:
        """Move the tip to a place, at a constant speed."""
        start, n = self.tip, round(seconds / PERIOD)
        for i in range(1, n + 1):
            self.period(tuple(a + i / n * (b - a) for a, b in zip(start, to, strict=True)))  # type: ignore[arg-type]

    def press(self) -> None:
        """Press until the force has come to rest."""
        self.rest(0.1)
        self.go((0.0, 0.0, -DEPTH), 0.2)
        self.rest(SETTLED)

    def columns(self) -> Columns:
        """What a recording would hold."""
        rows = np.array(self._rows)
        return dict(zip(columns_with(self.names), rows.T, strict=True))

    def save(self, path: Path) -> None:
        """Write a recording."""
        kept = Recorder(
            path, name="ann", loop_hz=1000.0, overwrite=True, tell=lambda _: None,
            rules={name: f"reason of {name}" for name in self.names},
        )  # fmt: skip
        kept.keep(b"".join(ROW.pack(*row) for row in self._rows))
        kept.finish()

    @property
    def length(self) -> float:
        """Time of the last row, since the first [s]."""
        return self._rows[-1][0] - self._rows[0][0]
