"""Metrics that a server's room gives, from a session in virtual time."""

from __future__ import annotations

import math

import pytest

from cohaptic.control.law import Law
from cohaptic.simulated.hand import HandScript
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_ops.monitoring.gather import Gatherer
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.server import CohapticServer


@pytest.mark.parametrize(
    ("bare", "law", "expected"),
    [
        # Devices with the full damping: the lag is for nobody in particular.
        ("", Law.PREDICTIVE, {}),
        ("right", Law.PREDICTIVE, {"right": "damping"}),
        ("left right", Law.PREDICTIVE, {"left": "damping", "right": "damping"}),
        # The user in the air does not count, whatever its device.
        ("air", Law.PREDICTIVE, {}),
        # Beside a law of the paper the lag is that of science 3.8.
        ("right", Law.PROPORTIONAL, {"right": "damping"}),
    ],
)
def test_it_tells_whose_device_the_lag_is_for(
    small_balloon: Balloon, bare: str, law: Law, expected: dict[str, str]
) -> None:
    server, session = CohapticServer(small_balloon, ServerSettings()), VirtualSession(small_balloon)
    session.room = server.room
    for name, angle, begin in (
        ("left", 0.0, 0.2), ("right", math.pi, 0.2), ("back", 1.6, 0.2), ("air", -1.6, 1e9),
    ):  # fmt: skip
        session.join(
            name,
            HandScript(angle, depth=0.008, approach_at=begin),
            law=law if name == "back" else Law.PREDICTIVE,
            max_damping=0.0 if name in bare.split() else 8.0,
        )
    session.run(1.5)
    reported = Gatherer(server).gather()
    assert reported.lag > 0.01
    assert {user.name: user.sets_lag for user in reported.users if user.sets_lag} == expected
