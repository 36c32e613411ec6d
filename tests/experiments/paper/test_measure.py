from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.protocol.messages import FixedGains
from cohaptic.simulated.hand import HandScript, Intention
from cohaptic_experiments.paper.measure import growth_per_tick, settling_time, swing
from cohaptic_experiments.paper.recording import record
from cohaptic_experiments.paper.rig import CLAMP, LIMITS, START, Press, press_at_plane
from cohaptic_experiments.paper.stiff_balloon import K_O, stiff_balloon, stiffness_at_x
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.spring import Spring, SpringSettings


@given(st.floats(0.5, 1.5).filter(lambda r: abs(r - 1.0) > 0.02))
def test_growth_of_an_alternating_oscillation(root: float) -> None:
    x = np.array([0.02 + 1e-3 * (-root) ** k for k in range(40)])
    assert growth_per_tick(x, 1e-6, 0.05) == pytest.approx(root, rel=1e-6)


def test_growth_needs_enough_steps() -> None:
    assert math.isnan(growth_per_tick(np.zeros(100), 1e-6, 1.0))
    assert math.isnan(growth_per_tick(0.5 ** np.arange(6.0), 1e-6, 1.0))


def test_settling_time_of_a_decay() -> None:
    t = np.arange(0.0, 10.0, 0.001)
    x = 1.0 - np.exp(-np.maximum(0.0, t - 1.0) / 0.5)
    assert settling_time(t, x, 1.0, 0.02) == pytest.approx(0.5 * math.log(50.0), abs=0.002)


def test_a_response_that_still_swings_has_not_settled() -> None:
    t = np.arange(0.0, 10.0, 0.001)
    assert settling_time(t, 1.0 + 0.1 * np.sin(20.0 * t), 1.0, 0.02) == math.inf
    assert swing(np.sin(20.0 * t)) == pytest.approx(2.0, rel=1e-3)


def test_the_stiff_balloon_is_as_stiff_as_it_should_be() -> None:
    assert stiffness_at_x(stiff_balloon(quick=True)) == pytest.approx(K_O, rel=1e-6)


def test_the_rig_holds_the_probe_and_the_trace_says_where() -> None:
    press = Press(FixedGains(k_h=50.0), 0.04, 1.0)
    trace, session = press_at_plane(Spring(SpringSettings(k_o=400.0)), press, lambda _: None)
    assert trace.probe[0] == pytest.approx(-0.01)
    assert trace.probe[-1] == pytest.approx(0.04, rel=2e-3)
    assert trace.intended[-1] == pytest.approx(0.04)
    assert trace.proxy[-1] == pytest.approx(0.04 * 50.0 / 450.0, rel=2e-3)
    assert trace.force[-1] == pytest.approx(400.0 * trace.proxy[-1], rel=1e-3)
    assert trace.t[-1] == pytest.approx(START + 1.0 - 0.001)
    assert len(trace.per_tick()) == 50
    state = session.users["clamp"].state.safety
    assert not state.fault
    assert state.scale == 1.0


def test_limits_and_intention_of_a_rig_reach_the_session() -> None:
    session = VirtualSession(Spring())
    press = Intention((0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.1, approach_at=START)
    script = HandScript(hand=CLAMP)
    session.join("user", script, limits=LIMITS, intention=press)
    trace = record(session, {"user": press}, START + 2.0, lambda _: None)["user"]
    # 20 N are twice the usual limit of a device.
    assert trace.force[-1] == pytest.approx(20.0, rel=0.01)
    assert trace.felt[-1] == pytest.approx(0.0, abs=1e-6)
