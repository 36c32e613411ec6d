"""Regression tests of contacts that once failed, as sessions in virtual time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from cohaptic.control.law import Law
from cohaptic.protocol.messages import GeometryName
from cohaptic.simulated.hand import Hand, HandScript, Intention, Rhythm
from cohaptic.vec import ZERO, Vec3, dot, norm, scale, sub
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.simulated import INFO
from cohaptic_client.loop.passivity import MAX_DAMPING, dissipate, observe
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession, VirtualUser
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.spring import Spring, SpringSettings

STEP = EXTERNAL_RATE * PERIOD  # N in a haptic period, beyond the change by the hand's own motion
ROUNDING = 1e-6  # N; patches are rounded to 32 bits


@pytest.fixture(scope="module")
def balloon() -> Balloon:
    return Balloon()


def into(depth: float, approach_at: float = 1.5) -> Intention:
    return Intention((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), depth, approach_at=approach_at)


def without_jumps(user: VirtualUser) -> bool:
    return max(user.unexplained) <= STEP + ROUNDING


# A held place (finding 0)


@pytest.mark.parametrize("geometry", ["plane", "sphere", "mesh"])
def test_a_finger_on_a_held_place_is_a_contact_like_any_other(
    balloon: Balloon, geometry: GeometryName
) -> None:
    """The balloon is held at its bottom: no compliance there, in the patch or the neighbourhood."""
    session = VirtualSession(balloon)
    below = Intention((0.0, 0.0, -0.1), (0.0, 0.0, 1.0), 0.003, approach_at=1.5)
    user = session.join("user", HandScript(), intention=below, geometry=geometry)
    session.run(5.0)
    force = np.array(user.force)
    assert np.ptp(force[-1500:]) < 0.01
    # The device's stiffness and the hand's, in a row: the place itself does not give way.
    k, device = HandScript().hand.stiffness, INFO.max_stiffness
    patch = user.state.patch
    assert patch is not None
    assert patch.k_h == pytest.approx(device)
    # The held ring lies flat, so the contact is a little in front of the tip's resting point.
    assert force[-1] == pytest.approx(0.003 / (1.0 / k + 1.0 / device), rel=0.1)
    assert without_jumps(user)


# An object stiffer than the device (finding 1)


@pytest.mark.parametrize(
    ("k_o", "hand", "delay"),
    [
        (5000.0, Hand(0.3, 2.0, 500.0), 0.0),
        (10_000.0, Hand(), 0.0),
        (5000.0, Hand(0.3, 2.0, 500.0), 0.08),
    ],
)
def test_a_device_softer_than_the_object_is_felt_with_its_own_stiffness(
    k_o: float, hand: Hand, delay: float
) -> None:
    session = VirtualSession(Spring(SpringSettings(k_o=k_o)))
    user = session.join("user", HandScript(hand=hand), delay=delay, intention=into(0.01))
    session.run(8.0)
    force = np.array(user.force)[-2000:]
    assert np.ptp(force) < 0.01
    # The steady state has the device's stiffness: no integral makes up for its limit.
    device = INFO.max_stiffness
    assert user.state.k_h == pytest.approx(device)
    assert force[-1] == pytest.approx(0.01 / (1.0 / hand.stiffness + 1.0 / device), rel=1e-3)
    assert without_jumps(user)


# Energy (finding 2)


RAIL = DeviceInfo("rail", 100.0, 1e6, 1e3, 1.0)


@dataclass
class Rail:
    """A device that follows a path under any force, and sums the work of the force.

    Args:
        x: Where its path begins [m].
        y: Same, sideways [m].
        depth: How far it goes in [m].
        swing: Amplitude in and out [m].
        side: Amplitude sideways [m].
        phase: Of its swing [rad].
    """

    x: float
    y: float
    depth: float
    swing: float
    side: float
    phase: float
    sign: float = 1.0
    work: float = 0.0
    info: DeviceInfo = RAIL
    _at: Vec3 = ZERO
    _force: Vec3 = ZERO
    _start: float | None = None

    def _position(self, t: float) -> Vec3:
        pressed, grown = self.depth * min(1.0, max(0.0, t - 1.0)), min(1.0, max(0.0, t - 2.0))
        turn = 2.0 * math.pi * SWING * t + self.phase
        x = self.x - pressed + grown * self.swing * math.sin(turn)
        return (self.sign * x, self.y + grown * self.side * math.sin(turn + 0.7), 0.0)

    def read(self, now: float) -> DeviceSample:
        """The position on the path; adds the work of the last force along the way."""
        if self._start is None:
            self._start, self._at = now, self._position(0.0)
        t = now - self._start
        position = self._position(t)
        self.work += dot(self._force, sub(position, self._at))
        self._at = position
        velocity = scale(sub(position, self._position(t - PERIOD)), 1.0 / PERIOD)
        return DeviceSample(position, velocity)

    def write(self, force: Vec3) -> None:
        """Held until the next period."""
        self._force = force

    def close(self) -> None:
        """Nothing to release."""


SWING, COUNTED = 2.0, 8.0  # Hz; s, whole periods of the swing


@dataclass
class Counted:
    """Energy that two hands on rails received, and that their loops observed [J].

    Args:
        work: Received by the rails.
        made: Observed by the loops' passivity layers.
        moved: What went to and fro: the sum of what the rails received in some periods and gave
            back in others, halved.
    """

    work: float
    made: float
    moved: float


def count(
    monkeypatch: pytest.MonkeyPatch,
    rails: list[Rail],
    session: VirtualSession,
    during: Callable[[VirtualSession, int], None] = lambda _session, _period: None,
    **join: Any,
) -> Counted:
    """Run rails for whole periods with loops that only observe, and sum energy on both sides."""
    made = [0.0]

    def counting(owed: float, work: float, stored: float, from_body: float, dt: float) -> float:
        made[0] += work + stored - from_body
        return observe(owed, work, stored, from_body, dt)

    monkeypatch.setattr("cohaptic_client.loop.rules.given.observe", counting)
    users = [
        # A budget this small only observes.
        session.join(f"user{i}", HandScript(), seed=i, device=rail, max_damping=1e-12, **join)
        for i, rail in enumerate(rails)
    ]
    session.run(8.0)
    made[0], before, colgate, moved = 0.0, sum(rail.work for rail in rails), 0.0, 0.0
    for period in range(round(COUNTED / PERIOD)):
        during(session, period)
        at, was = [user.state.probe for user in users], [rail.work for rail in rails]
        session.run(PERIOD)
        # The energy from holding a force over a period belongs to the device (Colgate).
        colgate += sum(
            0.5 * user.state.k_h * user.state.safety.scale * norm(sub(user.state.probe, x)) ** 2
            for user, x in zip(users, at, strict=True)
        )
        moved += 0.5 * sum(abs(rail.work - w) for rail, w in zip(rails, was, strict=True))
    return Counted(sum(rail.work for rail in rails) - before - colgate, made[0], moved)


def on_a_plate(phase: float) -> list[Rail]:
    return [Rail(0.01, y, 0.015, 0.003, 0.0, p) for y, p in ((-0.05, 0.0), (0.05, phase))]


PHASES = [0.5 * math.pi, -0.5 * math.pi]


@pytest.mark.parametrize(
    ("delay", "jitter", "phase"),
    [(0.05, 0.0, PHASES[0]), (0.1, 0.0, PHASES[1]), (0.2, 0.06, PHASES[1])],
)
def test_energy_from_the_network_is_observed(
    monkeypatch: pytest.MonkeyPatch, delay: float, jitter: float, phase: float
) -> None:
    """Two hands driven on one plate: their loops observe their work over whole periods."""
    plate = VirtualSession(Spring(SpringSettings(k_o=300.0)))
    energy = count(monkeypatch, on_a_plate(phase), plate, delay=delay, jitter=jitter)
    assert energy.made == pytest.approx(energy.work, abs=0.01 * energy.moved)


@pytest.mark.parametrize("phase", PHASES[:1])
def test_energy_from_a_fade_is_observed(monkeypatch: pytest.MonkeyPatch, phase: float) -> None:
    """The server is silent for 0.3 s: the force fades, and is engaged again under a pressed hand.

    The body's work meanwhile is observed along a chord instead of its path: most of the error.
    """

    def silence(session: VirtualSession, period: int) -> None:
        session.users["user0"].listening = not 1000 < period < 1300

    plate = VirtualSession(Spring(SpringSettings(k_o=300.0)))
    energy = count(monkeypatch, on_a_plate(phase), plate, silence, delay=0.1)
    assert energy.made == pytest.approx(energy.work, abs=0.01 * energy.moved)


@pytest.mark.parametrize("side", [0.0, 0.004])
def test_energy_along_the_surface_is_observed(
    monkeypatch: pytest.MonkeyPatch, balloon: Balloon, side: float
) -> None:
    """With friction, pressed and dragged on both sides of the balloon."""
    rails = [Rail(0.102, 0.0, 0.012, 0.003, side, 0.0), Rail(0.102, 0.0, 0.012, 0.003, side, 1.6)]
    rails[1].sign = -1.0
    energy = count(
        monkeypatch, rails, VirtualSession(balloon), delay=0.1, friction=0.5, geometry="mesh"
    )
    assert energy.made == pytest.approx(energy.work, abs=0.01 * energy.moved)


# Damping (finding 4)


def test_the_layers_damping_comes_and_goes_with_the_contact() -> None:
    """A hand that comes in fast on the least of contacts, with energy owed and all damping on."""
    for force in (1e-3, 0.01, 0.1, 1.0):
        _, damped = dissipate(0.05, MAX_DAMPING, force, 0.3, PERIOD, MAX_DAMPING)
        assert 0.0 <= damped <= 2.0 * force
    assert dissipate(0.05, MAX_DAMPING, 0.0, 0.3, PERIOD, MAX_DAMPING)[1] == 0.0


def test_two_who_press_in_rhythms_far_away_feel_no_jump(balloon: Balloon) -> None:
    session = VirtualSession(balloon)
    users = [
        session.join(name, HandScript(angle=angle, depth=depth, rhythm=Rhythm(period)), delay=0.25)
        for name, angle, depth, period in (
            ("left", math.pi, 0.02, 0.4),
            ("right", 0.0, 0.015, 0.37),
        )
    ]
    session.run(8.0)
    for user in users:
        assert max(user.force) > 0.5
        assert without_jumps(user)
        # The damping at most doubles the change of the force by the hand's own motion.
        assert np.abs(np.diff(user.force)).max() < 0.2


# Jitter (finding 6)


def test_a_user_on_a_link_that_jitters_is_no_pulse_for_the_others(balloon: Balloon) -> None:
    session = VirtualSession(balloon)
    session.join("far", HandScript(math.pi, depth=0.015), delay=0.02, jitter=0.4, seed=3)
    near = session.join("near", HandScript(0.0, depth=0.01), delay=0.01)
    session.run(25.0)
    # It takes the link's measure in the first seconds.
    assert np.ptp(near.force[8000:]) < 0.1
    assert without_jumps(near)


# An integral beside others who come, go and stop


@pytest.mark.parametrize("delay", [0.0, 0.04, 0.125])
@pytest.mark.parametrize("others", ["mute", "frozen", "gone", "beside", "law"])
def test_an_integral_moves_a_hand_no_faster_than_another_law(
    balloon: Balloon, others: str, delay: float
) -> None:
    session = VirtualSession(balloon)
    hand = Hand(1.0, 60.0, 20_000.0)  # a clamp: the hand itself does not give way

    def join(name: str, angle: float, depth: float) -> VirtualUser:
        return session.join(name, HandScript(angle, depth, hand=hand), law=Law.PI, delay=delay)

    users = [join("a", math.pi, 0.008), join("b", 0.0, 0.02)]
    session.run(3.0)
    if others == "mute":
        users[1].talking = False
    elif others == "frozen":
        session.room.frozen = True
    elif others == "gone":
        session.drop("b")
    elif others == "beside":
        users.append(join("c", math.pi - 0.2, 0.02))
    else:
        session.set_law("a", Law.PREDICTIVE)
    session.run(2.0)
    users[1].talking, session.room.frozen = True, False
    session.set_law("a", Law.PI)
    session.run(2.0)
    for user in users:
        assert max(user.force) > 1.0
        assert without_jumps(user)
