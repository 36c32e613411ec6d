"""The simulated device for the catalogue, and its presets.

A preset gives the simulated device the limits and the mechanics of a real one. The largest force,
stiffness and damping are those that CHAI3D ships for each device (`src/devices`), and for the
Inverse3 those of a fork of it; forces are short-time maxima. Everything else is an ASSUMPTION of
the size that data sheets and measurements of such devices report, not checked on a device:

- the physical damping b is exactly what Colgate's bound asks for at that stiffness and 1 kHz,
  b = K T / 2, because the authors judged the stiffness usable. This leaves nothing for the
  passivity layer: its budget is 0, and the room's lag has to do without it (science 3.8);
- the apparent mass and the Coulomb friction of the tip, the step of its sensors, and the time from
  a motion to its report.
"""

from __future__ import annotations

from typing import Final

from cohaptic_client.devices.choice import DeviceChoice
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.kind import DeviceKind
from cohaptic_client.devices.simulated import INFO, SimulatedDevice

_PERIOD: Final = 0.001  # s; period of the loops for which the stiffness was judged usable


def _preset(
    name: str,
    *,
    force: float,
    stiffness: float,
    damping: float,
    mass: float,
    friction: float,
    step: float,
    latency: float,
) -> DeviceInfo:
    """Make the abilities of a simulated device with the limits and mechanics of a real one.

    Args:
        name: Name shown to users.
        force: Largest force [N].
        stiffness: Largest stiffness that is rendered stably [N/m].
        damping: Largest damping that may be rendered [N s/m].
        mass: Apparent mass of the tip [kg].
        friction: Friction of the mechanics [N].
        step: Least step of position that the sensors tell apart [m].
        latency: Time from a motion to its report [s].
    """
    return DeviceInfo(
        name,
        max_force=force,
        max_stiffness=stiffness,
        damping=0.5 * stiffness * _PERIOD,
        stall=1.0,  # as for every simulated hand
        max_damping=damping,
        inertia=mass,
        friction=friction,
        resolution=step,
        latency=latency,
    )


PRESETS: Final = {
    "touch": _preset(
        "simulated Touch", force=3.3, stiffness=400.0, damping=4.0,
        mass=0.045, friction=0.26, step=55e-6, latency=0.001,
    ),
    "omni": _preset(
        "simulated Phantom Omni", force=3.3, stiffness=700.0, damping=5.0,
        mass=0.045, friction=0.26, step=55e-6, latency=0.001,
    ),
    "desktop": _preset(
        "simulated Phantom Desktop", force=7.9, stiffness=1000.0, damping=5.0,
        mass=0.045, friction=0.06, step=23e-6, latency=0.001,
    ),
    "falcon": _preset(
        "simulated Falcon", force=8.0, stiffness=3000.0, damping=20.0,
        mass=0.1, friction=0.4, step=64e-6, latency=0.001,
    ),
    "omega3": _preset(
        "simulated omega.3", force=12.0, stiffness=5000.0, damping=30.0,
        mass=0.22, friction=0.2, step=10e-6, latency=0.0005,
    ),
    "lambda7": _preset(
        "simulated lambda.7", force=12.0, stiffness=8000.0, damping=30.0,
        mass=0.3, friction=0.3, step=2e-6, latency=0.0005,
    ),
    "inverse3": _preset(
        "simulated Inverse3", force=10.0, stiffness=1000.0, damping=6.0,
        mass=0.12, friction=0.2, step=10e-6, latency=0.001,
    ),
}  # fmt: skip


_RIG = "rig"  # the default, which is the rig of `INFO` and no preset


def simulated_info(choice: DeviceChoice) -> DeviceInfo:
    """Abilities of the simulated device; raises SettingError for an unknown preset."""
    preset = choice.one_of("preset", (_RIG, *PRESETS), _RIG)
    return INFO if preset == _RIG else PRESETS[preset]


def open_simulated(config: DeviceConfig) -> SimulatedDevice:
    """Make a device of the chosen preset, with a hand that follows the intention."""
    assert config.intention is not None
    info = simulated_info(config.choice)
    return SimulatedDevice(config.hand, config.intention, info, waits=True)


KIND = DeviceKind(
    "simulated",
    "a hand that follows a script, on a device in virtual air",
    (("preset", f"limits and mechanics of a device: {', '.join(PRESETS)}; or {_RIG}"),),
    simulated_info,
    open_simulated,
)
