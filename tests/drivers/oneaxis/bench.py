"""A driver, its unit file, and boards with the real firmware, for a test."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import open_device, read_device
from cohaptic_client.devices.device import Device
from tests.client.devices.until import until
from tests.client.plane import CONFIG
from tests.drivers.oneaxis.board import Board

CLOCK = SystemClock()
PUSH: Vec3 = (0.3, -1.2, 0.4)  # N; 1.2 of them toward the user, which is its axis
UNIT = """
counts_per_metre = 80000
sensor_direction = 1
motor_direction = 1
torque_constant = 0.02
gear = 20
handle_radius = 0.08
"""  # 5 N for an ampere


class Bench:
    def __init__(self, unit: Path) -> None:
        self.unit = unit
        self.unit.write_text(UNIT)
        self.boards: list[Board] = []
        self.devices: list[Device] = []

    def board(self, limit: int = 500, watchdog: int = 100, *, swallow: int = 0) -> Board:
        """A board; on a busy machine it waits as long for its host as a board may."""
        self.boards.append(Board(limit, watchdog, swallow=swallow))
        return self.boards[-1]

    def open(self, board: Board, options: str = "") -> Device:
        text = f"oneaxis:port={board.path},unit={self.unit}" + (f",{options}" if options else "")
        self.devices.append(open_device(replace(CONFIG.device, choice=read_device(text))))
        return self.devices[-1]

    def complaint(self, board: Board, options: str = "") -> str:
        with pytest.raises(DeviceError) as caught:
            self.open(board, options)
        assert "\n" not in str(caught.value)
        return str(caught.value)

    def step(self, device: Device, force: Vec3 = PUSH) -> bool:
        device.read(CLOCK.now())
        device.write(force)
        return True

    def press(self, device: Device, board: Board) -> None:
        until(lambda: self.step(device) and board.current < -0.2)

    def end_of(self, device: Device) -> str:
        def ended() -> bool:
            try:
                self.step(device)
            except DeviceError as error:
                reported.append(str(error))
            return bool(reported)

        reported: list[str] = []
        until(ended)
        assert "\n" not in reported[0]
        return reported[0]
