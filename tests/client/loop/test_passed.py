"""Devices and rules on their way from a script to the process of the haptic loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from cohaptic.errors import DeviceError, SettingError
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import device_info, names
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.loop.passed import UNKNOWN, Luggage, Passed, pass_on, unpack

INFO = DeviceInfo("stick", max_force=2.0, max_stiffness=300.0, switch=True, held=False)


@dataclass
class Stick:
    place: Vec3 = (1.0, 2.0, 3.0)
    closed: int = 0

    def read(self, now: float) -> DeviceSample:
        return DeviceSample(self.place, (0.0, 0.0, now))

    def write(self, force: Vec3) -> None:
        self.place = force

    def close(self) -> None:
        self.closed += 1


class Known(Stick):
    info = INFO


class Half:
    name = "half"
    reason = "half of the force"
    is_law = False

    def begin(self) -> int:
        return 0

    def apply(self, memory: int, contact: Any) -> int:
        return memory + 1


def travel(device: object, rules: tuple[Any, ...] = ()) -> tuple[Passed, Luggage]:
    passed = pass_on(device, rules)
    assert passed is not None
    return passed, unpack(passed.pickle, passed.choice or DeviceChoice("scripted"))


@pytest.mark.parametrize("given", [Stick(), Stick, lambda: Stick()])
def test_an_object_a_class_and_a_function_become_a_device(given: object) -> None:
    passed, (device, _) = travel(given)
    assert device is not None
    sample = device.read(4.0)
    assert (sample.position, sample.velocity) == ((1.0, 2.0, 3.0), (0.0, 0.0, 4.0))
    device.write((5.0, 6.0, 7.0))
    assert device.read(0.0).position == (5.0, 6.0, 7.0)
    device.close()
    assert passed.choice is not None
    assert device.info == device_info(passed.choice)
    assert device.info.max_stiffness == UNKNOWN.max_stiffness


@pytest.mark.parametrize("given", [Known(), Known])
def test_its_own_abilities_are_known_before_and_behind_the_way(given: object) -> None:
    passed, (device, _) = travel(given)
    assert passed.choice is not None
    assert device is not None
    assert device_info(passed.choice) == device.info == INFO


def test_what_a_script_keeps_of_our_values_arrives_whole() -> None:
    """Compiled classes have no state that `pickle` knows of, and would arrive empty."""
    stick = Stick()
    stick.__dict__["kept"] = (INFO, DeviceSample((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.5))
    _, (device, _) = travel(stick)
    held: Any = device
    info, sample = held._device.kept
    assert info == INFO
    assert (sample.position, sample.level, sample.fresh) == ((1.0, 0.0, 0.0), 0.5, True)


def test_rules_travel_in_their_order_and_names_stay_at_home() -> None:
    passed, luggage = travel(None, (Half(), "edge", Half()))
    assert passed.choice is None
    assert luggage.device is None
    assert [rule.name for rule in luggage.rules] == ["half", "half"]
    assert luggage.rules[0].apply(3, None) == 4  # type: ignore[arg-type]
    assert pass_on(None, ("edge",)) is None


class Locked(Stick):
    def __reduce__(self) -> Any:
        raise OSError("a port is open")


@pytest.mark.parametrize("given", [3, object(), "x", Locked()])
def test_what_is_no_device_or_cannot_travel_is_refused_with_advice(given: object) -> None:
    with pytest.raises(SettingError, match="function"):
        pass_on(given)


class Missing:
    def __init__(self) -> None:
        raise OSError("nothing at the port")


@pytest.mark.parametrize(("given", "words"), [(Missing, "nothing at the port"), (list, "no read")])
def test_one_that_cannot_be_made_says_so(given: object, words: str) -> None:
    passed = pass_on(given)
    assert passed is not None
    assert passed.choice is not None
    with pytest.raises(DeviceError, match=words):
        unpack(passed.pickle, passed.choice)


def test_users_of_the_command_line_do_not_see_it() -> None:
    assert "passed" not in names()
    with pytest.raises(SettingError, match="by a script"):
        device_info(DeviceChoice("passed"))
