"""The configuration of the loop's process, which it gets as JSON on its command line."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace

from cohaptic.control.laws.model import LawSettings, Thresholds
from cohaptic.errors import SettingError
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.kind import DeviceConfig
from cohaptic_client.loop.safety import SafetyLimits


@dataclass(frozen=True, slots=True)
class LoopConfig:
    """Settings and paths that a loop's process needs at its start.

    Args:
        memory: Path of the shared memory.
        clock_origin: Origin of the network process's clock, so that both processes read the same
            time [s].
        haptic_period: Haptic period T, from 1/4000 to 1/500 [s].
        simulation_period: Time between two patches, N haptic periods [s].
        law: Settings of the law's integral.
        smoothing: Fraction of a simulation period over which the loop moves to a new patch, 0 to 1.
        max_damping: Largest damping of the passivity layer; 0 switches the layer off [N s/m].
        friction: Coefficient of friction mu of the contact; 0 for none.
        follow: Whether the gains follow the compliance C_ii while the probe slides over the body.
        device: Device that the process opens.
        limits: Limits of the safety layer.
        rest_mesh: Path of a file with the frame of the resting mesh; None if patches have no mesh.
        every_row: Whether the loop writes a row for every period; otherwise it writes one every
            0.05 s.
        fault: Fault of the previous loop that the user has not acknowledged; empty for none.
        rules: Names of rules of other packages, in the order in which they act; empty for the next
            one of a script.
        passed: Whether a script passes a device or rules to the process.
    """

    memory: str
    clock_origin: float
    haptic_period: float
    simulation_period: float
    law: LawSettings
    smoothing: float
    max_damping: float
    friction: float
    follow: bool
    device: DeviceConfig
    limits: SafetyLimits
    rest_mesh: str | None = None
    every_row: bool = True
    fault: str = ""
    rules: tuple[str, ...] = ()
    passed: bool = False

    def __post_init__(self) -> None:
        if not 1.0 / 4000 <= self.haptic_period <= 1.0 / 500:
            limit = "from 0.00025 to 0.002 s"
            raise SettingError("haptic period", f"{self.haptic_period} s", limit)

    def to_json(self) -> str:
        """Return the configuration as a text that `from_json` reads."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> LoopConfig:
        """Read the configuration in a text that `to_json` has written."""
        raw = json.loads(text)
        return cls(
            **raw
            | {
                "law": LawSettings(Thresholds(*raw["law"][0]), *raw["law"][1:]),
                "device": DeviceConfig.from_dict(raw["device"]),
                "limits": SafetyLimits(**raw["limits"]),
                "rules": tuple(raw["rules"]),
            }
        )


def limits_on(limits: SafetyLimits, info: DeviceInfo) -> SafetyLimits:
    """Lower the limits to the abilities of the opened device.

    The device's options may not have shown all its abilities before it was opened.

    Args:
        limits: Limits from the user's settings.
        info: Abilities of the opened device.
    """
    return replace(
        limits,
        max_force=min(limits.max_force, info.max_force or limits.max_force),
        dead_man=limits.dead_man and info.switch,
    )


def silent_after(simulation_period: float) -> float:
    """Return the time without a patch [s] that counts as silence: 3 ticks, at least 0.1 s.

    Shorter jitter does not disturb the hand. The fade of the force takes at least `fade_time`.
    """
    return max(0.1, 3.0 * simulation_period)


# s; least time in which a law's integral is released: 1 % of it in a millisecond, as `GAIN_RATE`
# lets a gain change. The paper says two simulation periods (5.1). Reasoned, not measured.
INTEGRAL_RELEASE_TIME = 0.1


def law_settings(
    thresholds: Thresholds, simulation_period: float, limits: SafetyLimits
) -> LawSettings:
    """Make the settings of a law's integral.

    The integral is released over two simulation periods (section 5.1), but by at most 1 % of it per
    millisecond.
    """
    release_time = max(INTEGRAL_RELEASE_TIME, 2.0 * simulation_period)
    return LawSettings(thresholds, release_time, limits.max_force)


def haptic_period(loop_hz: float) -> float:
    """Return the haptic period [s] at a loop rate; raise SettingError outside 500 to 4000 Hz."""
    if not 500.0 <= loop_hz <= 4000.0:
        raise SettingError("loop rate", f"{loop_hz} Hz", "from 500 to 4000 Hz")
    return 1.0 / loop_hz
