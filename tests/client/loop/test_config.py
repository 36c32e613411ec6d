from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.laws.model import LawSettings, Thresholds
from cohaptic.errors import SettingError
from cohaptic.simulated.hand import Hand, Intention, Rhythm
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.kind import DeviceChoice, DeviceConfig
from cohaptic_client.loop.config import LoopConfig, haptic_period, limits_on, silent_after
from cohaptic_client.loop.safety import SafetyLimits
from tests.client.plane import CONFIG
from tests.strategies import vectors

numbers = st.floats(allow_nan=False)
positive = st.floats(1e-3, 1e3)
intentions = st.builds(
    Intention,
    surface=vectors(1.0),
    direction=vectors(1.0),
    depth=numbers,
    clearance=numbers,
    approach_at=numbers,
    approach_time=numbers,
    rhythm=st.none() | st.builds(Rhythm, st.floats(0.1, 3600.0)),
    drag=vectors(0.1),
)
configs = st.builds(
    LoopConfig,
    memory=st.text(max_size=40),
    clock_origin=numbers,
    haptic_period=st.floats(1.0 / 4000, 1.0 / 500),
    simulation_period=positive,
    law=st.builds(
        LawSettings,
        st.builds(Thresholds, numbers, numbers, numbers),
        release_time=positive,
        max_force=positive,
    ),
    smoothing=numbers,
    max_damping=numbers,
    friction=numbers,
    follow=st.booleans(),
    device=st.builds(
        DeviceConfig,
        st.builds(
            DeviceChoice,
            st.text(max_size=10),
            st.lists(st.tuples(st.text(max_size=5), st.text(max_size=5)), max_size=3).map(tuple),
        ),
        vectors(10.0),
        positive,
        st.builds(Hand, mass=st.floats(0.01, 5.0), stiffness=st.floats(1.0, 5000.0)),
        st.none() | intentions,
    ),
    limits=st.builds(
        SafetyLimits,
        max_force=positive,
        stall=positive,
        engage_periods=st.integers(0, 100),
        period=st.floats(1.0 / 4000, 1.0 / 500),
    ),
    rest_mesh=st.none() | st.text(max_size=40),
)


@given(configs)
def test_comes_back_as_it_was(config: LoopConfig) -> None:
    assert LoopConfig.from_json(config.to_json()) == config


@pytest.mark.parametrize("loop_hz", [499.0, 10.0, 0.0, -1000.0, 4001.0, math.inf, math.nan])
def test_any_other_rate_is_refused_with_the_limits(loop_hz: float) -> None:
    with pytest.raises(SettingError, match=r"^loop rate is .* Hz; it must be from 500 to 4000 Hz$"):
        haptic_period(loop_hz)


@pytest.mark.parametrize("period", [0.0021, 0.0002, 0.0, -0.001, math.inf, math.nan])
def test_a_configuration_with_another_period_cannot_be_made(period: float) -> None:
    with pytest.raises(
        SettingError, match=r"haptic period is .* s; it must be from 0.00025 to 0.002 s"
    ):
        replace(CONFIG, haptic_period=period)


@pytest.mark.parametrize(("hz", "expected"), [(200.0, 0.1), (60.0, 0.1), (20.0, 0.15), (10.0, 0.3)])
def test_a_server_is_silent_after_three_ticks_and_a_tenth_of_a_second_at_least(
    hz: float, expected: float
) -> None:
    assert silent_after(1.0 / hz) == pytest.approx(expected)


@given(st.booleans(), st.booleans(), st.floats(0.0, 40.0), st.floats(0.1, 40.0))
def test_the_device_that_was_opened_has_the_last_word_on_switch_and_force(
    wanted: bool, switch: bool, device_force: float, max_force: float
) -> None:
    info = DeviceInfo("arm", device_force, 1000.0, switch=switch)
    asked = SafetyLimits(max_force=max_force, dead_man=wanted)
    limits = limits_on(asked, info)
    assert limits.dead_man is (wanted and switch)
    assert limits.max_force == (min(max_force, device_force) if device_force > 0.0 else max_force)
    assert limits == replace(asked, dead_man=limits.dead_man, max_force=limits.max_force)
