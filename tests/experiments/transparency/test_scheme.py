"""The session of schemes: its links, its ticks, and this program as a scheme."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import HandScript
from cohaptic.vec import Vec3
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.devices.simulated import SimulatedDevice
from cohaptic_experiments.transparency.product import Product, Variant
from cohaptic_experiments.transparency.scheme import Arrived, SchemeSession
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon


class Echo:
    """Clients send the time, and the server sends everybody the newest time that came."""

    def __init__(self, period: float) -> None:
        self.period = period
        self.ticks: list[float] = []
        self.ages: list[float] = []
        self.waits: list[float] = []

    def client(
        self, user: int, now: float, sample: DeviceSample, inbox: Sequence[float]
    ) -> tuple[Vec3, float | None]:
        self.ages += [now - sent for sent in inbox]
        return (float(user), 0.0, 0.0), now

    def server(
        self, now: float, inboxes: Mapping[int, Sequence[Arrived[float]]]
    ) -> Mapping[int, float]:
        self.ticks.append(now)
        self.waits += [now - arrived.at for came in inboxes.values() for arrived in came]
        return {user: came[-1].message for user, came in inboxes.items() if came}


def devices(n: int, small_balloon: Balloon) -> list[SimulatedDevice]:
    setting = Setting(small_balloon, n)
    return setting.devices(setting.intentions(), clamped=False)


@pytest.mark.parametrize(
    ("delay", "period"), [(0.0, 1.0 / 60.0), (0.08, 1.0 / 60.0), (0.01, 0.005)]
)
def test_a_message_takes_both_ways_and_less_than_a_tick(
    delay: float, period: float, small_balloon: Balloon
) -> None:
    scheme = Echo(period)
    _, forces = SchemeSession(scheme, devices(2, small_balloon), LinkSettings(delay)).run(1.0)
    assert len(scheme.ticks) == pytest.approx(1.0 / period, abs=1)
    assert np.diff(scheme.ticks) == pytest.approx(period, abs=PERIOD)
    assert min(scheme.ages) >= 2.0 * delay - 1e-9
    assert max(scheme.ages) <= 2.0 * delay + 3.0 * PERIOD
    assert 0.0 <= min(scheme.waits) <= max(scheme.waits) <= period
    assert forces[:, -1].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("law", list(Law))
def test_the_program_as_a_scheme_is_the_program(law: Law, small_balloon: Balloon) -> None:
    """The same forces, to the last bit, as in the session that the experiments use."""
    setting = Setting(small_balloon, 2, link=LinkSettings(0.02))
    plans = setting.intentions()
    _, forces = setting.play(Product(small_balloon, 2, Variant(law)), plans, 4.0)
    session = VirtualSession(small_balloon, now=0.0)
    for user, plan in enumerate(plans):
        session.join(
            f"user {user}", HandScript(), law=law, delay=0.02, geometry="mesh", intention=plan
        )
    session.run(4.0)
    expected = np.array([user.force for user in session.users.values()])
    assert expected[:, -1].min() > 0.5
    assert np.array_equal(forces, expected)
