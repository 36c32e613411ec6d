"""Devices and rules that a script passes as objects: they live in the process of the haptic loop.

They travel there by `cloudpickle`, which takes classes of a script or a notebook along, too.
Hardware cannot travel: a script passes the class, or a function, that opens the device, and the
loop's process calls that.
"""

from __future__ import annotations

import io
import json
import pickle
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from typing import Any, Final, NamedTuple, cast

from cohaptic.errors import CohapticError, DeviceError, SettingError
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.devices.device import Device, DeviceInfo, DeviceSample
from cohaptic_client.devices.kind import DeviceChoice
from cohaptic_client.devices.passed import passed_choice
from cohaptic_client.loop.added import RuleChoice
from cohaptic_client.loop.added_rule import AddedRule

# Abilities of an object that says none: those of the weakest device on many desks, the Phantom
# Omni, whose largest stiffness is that of its preset in `simulated`.
UNKNOWN: Final = DeviceInfo("", max_force=3.3, max_stiffness=700.0, damping=0.35)
# Bytes; a device holds settings and not data, and the loop does not start before it has all.
MAX_PICKLE: Final = 16 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class Passed:
    """A device and rules on their way to the process of the haptic loop.

    Args:
        choice: Choice that has the abilities of the device; None if only rules travel.
        pickle: Where the script finds its modules, then device and rules, as `pickle` reads them.
    """

    choice: DeviceChoice | None
    pickle: bytes


def pass_on(device: object, rules: Sequence[RuleChoice] = ()) -> Passed | None:
    """Make a device and rules of a script ready for their way to the process of the haptic loop.

    Args:
        device: Object with `read(now) -> DeviceSample` and `write(force)`; or a class or function
            without arguments that makes one in the process of the loop; None for no object. `info`,
            a `DeviceInfo`, and `close()` are used if it has them.
        rules: Rules of the loop; those that are names do not travel.

    Returns:
        What travels; None if nothing does.

    Raises:
        SettingError: The device is none, or something cannot travel.
    """
    travelling = [rule for rule in rules if not isinstance(rule, str)]
    if device is None and not travelling:
        return None
    if device is not None:
        _check(device)
    try:
        data = _packed((device, travelling))
    except Exception as error:  # an object may raise anything when it is taken apart
        limit = f"able to travel to the loop's process ({error}); pass a function that opens it"
        raise SettingError("device or rule", _kind_of(device), limit) from error
    if len(data) > MAX_PICKLE:
        raise SettingError("device or rule", f"{len(data)} bytes", f"at most {MAX_PICKLE} bytes")
    if device is None:
        return Passed(None, data)
    return Passed(passed_choice(json.dumps(asdict(_info_of(device)))), data)


def _packed(things: object) -> bytes:
    """Return the path of a script's modules and what it passes, as `pickle` reads them."""
    # Imported here, because the process that unpacks has no need of it.
    import cloudpickle

    class Packer(cloudpickle.Pickler):  # type: ignore[misc]  # it has no types
        """Packs values of our own dataclasses by their fields: compiled ones have no state."""

        def reducer_override(self, obj: Any) -> Any:
            thing: object = obj
            kind = type(thing)
            if is_dataclass(thing) and kind.__module__.startswith("cohaptic"):
                return kind, tuple(getattr(thing, field.name) for field in fields(thing))
            whole = cast(Any, super())
            return whole.reducer_override(obj)

    data = io.BytesIO()
    pickle.dump(sys.path, data)
    packer: Any = Packer(data)
    packer.dump(things)
    return data.getvalue()


def _check(device: object) -> None:
    """Raise SettingError for what is no device and makes none."""
    if not (callable(device) if _makes(device) else hasattr(device, "write")):
        limit = (
            "an object with read(now) and write(force), or a class or function that makes one, "
            "or a text as after --device"
        )
        raise SettingError("device", _kind_of(device), limit)


def _makes(device: object) -> bool:
    """Whether something is no device itself, and has to be called for one."""
    return isinstance(device, type) or not hasattr(device, "read")


def _kind_of(device: object) -> str:
    kind = device if isinstance(device, type) else type(device)
    return f"of {kind.__module__}.{kind.__qualname__}"


def _info_of(device: object) -> DeviceInfo:
    """Return the abilities that an object states; those of `UNKNOWN` if it states none."""
    info = getattr(device, "info", None)
    if isinstance(info, DeviceInfo):
        return info
    name = getattr(device, "__name__", type(device).__name__)
    return replace(UNKNOWN, name=str(name))


class PassedDevice:
    """An object of a script as a device: with abilities and an end, whatever it has itself."""

    def __init__(self, device: Any, info: DeviceInfo) -> None:
        self._device, self._info = device, info
        # Bound here, because the loop calls them in every period.
        self.read: Callable[[float], DeviceSample] = device.read
        self.write: Callable[[Vec3], None] = device.write
        if hasattr(device, "release"):
            self.release: Callable[[], None] = device.release

    @property
    def info(self) -> DeviceInfo:
        """Abilities of the device."""
        return self._info

    def close(self) -> None:
        """Close the object, if it can be closed."""
        if hasattr(self._device, "close"):
            self._device.close()


class Luggage(NamedTuple):
    """What a script has passed, in the process of the haptic loop.

    Fields:
        device: The device; None if none was passed.
        rules: The rules, in their order.
    """

    device: Device | None
    rules: tuple[AddedRule, ...]


def unpack(data: bytes, choice: DeviceChoice) -> Luggage:
    """Make device and rules again from the bytes of `pass_on`, in the process of the haptic loop.

    Args:
        choice: Choice of the device.

    Raises:
        DeviceError: They cannot be made, or the device has neither `read` nor `write`.
    """
    name = device_info(choice).name
    parts = io.BytesIO(data)  # from the process that has started this one, by a pipe
    try:
        # Modules of a script are beside it, and this process has begun in another folder.
        sys.path += [place for place in pickle.load(parts) if place not in sys.path]
        device, rules = pickle.load(parts)
        if device is not None and _makes(device):
            device = device()
    except CohapticError:
        raise
    except Exception as error:  # what is foreign may raise anything
        advice = "pass a function that opens it, or put its class in a module"
        raise DeviceError(name, f"it cannot be made ({error!r})", advice) from error
    if device is None:
        return Luggage(None, tuple(rules))
    if not (hasattr(device, "read") and hasattr(device, "write")):
        raise DeviceError(name, "it has no read(now) or no write(force)", "add what is missing")
    own = getattr(device, "info", None)
    info = own if isinstance(own, DeviceInfo) else device_info(choice)
    return Luggage(cast(Device, PassedDevice(device, info)), tuple(rules))
