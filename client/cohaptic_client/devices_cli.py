"""`cohaptic devices`: lists devices and their options, knocks with a device, calibrates it.

A knock is a gentle push on the hand. It shows which device is which, and whether the device pushes
in the right direction.
"""

from __future__ import annotations

import math
import sys
from typing import Annotated

import typer

from cohaptic.cli.app import ChapterCommand
from cohaptic.clock import Clock, SystemClock
from cohaptic.errors import DeviceError, SettingError
from cohaptic.runtime.interrupt import signals_put_off
from cohaptic.simulated.hand import Hand
from cohaptic.vec import ZERO, Vec3, dot, scale, sub
from cohaptic_client.devices.catalogue import device_kind, names, open_device, read_device, search
from cohaptic_client.devices.device import Device
from cohaptic_client.devices.kind import DeviceConfig

# N; a hand on the device feels it at once (a fingertip notices 0.05 N), but it hardly moves a
# device that nobody holds against the friction of its mechanics.
STRENGTH = 0.5
KNOCKS = 3
LENGTH = 0.12  # s of a knock; half a sine, so that the force rises by at most about 13 N/s
_REST = 0.2  # s between two knocks
_PERIOD = 0.001  # s
_UP: Vec3 = (0.0, 0.0, 1.0)
# m; least motion that counts: a hand of 400 N/m yields by 1 mm, a resting hand wanders by less
CLEAR = 0.0003


def pulse_force(t: float, direction: Vec3 = _UP, strength: float = STRENGTH) -> Vec3:
    """Return the force [N] at time `t` in a series of gentle pushes, each of them half a sine.

    Args:
        t: Time since the start [s].
        direction: Direction of the pushes; a unit vector.
        strength: Peak force of each push [N].
    """
    number, within = divmod(t, LENGTH + _REST)
    if t < 0.0 or number >= KNOCKS or within >= LENGTH:
        return ZERO
    return scale(direction, strength * math.sin(math.pi * within / LENGTH))


def pulse(device: Device, clock: Clock, direction: Vec3 = _UP) -> list[float]:
    """Knock on the hand, then close the device; return how far each knock moved the tip.

    Args:
        device: Open device; it is closed even after an error.
        direction: Direction of the pushes; a unit vector.

    Returns:
        Displacement of the tip along `direction` in each knock, as a mean weighted by the force
        [m]. A device that pushes in the right direction has positive displacements, however it is
        held.

    Raises:
        DeviceError: The device gives no force, or is gone.
    """
    try:
        with signals_put_off() as ended:
            if device.info.max_force == 0.0:
                raise DeviceError(device.info.name, "it only senses, so that it cannot knock")
            strength = min(STRENGTH, device.info.max_force)
            ways, pushes = [0.0] * KNOCKS, [0.0] * KNOCKS
            start, before, last = clock.now(), ZERO, -1
            while (t := clock.now() - start) < KNOCKS * (LENGTH + _REST) and not ended():
                place = device.read(clock.now()).position
                number = min(KNOCKS - 1, int(t / (LENGTH + _REST)))
                if number != last:
                    before, last = place, number
                force = pulse_force(t, direction, strength)
                push = dot(force, direction)
                ways[number] += push * dot(sub(place, before), direction)
                pushes[number] += push
                device.write(force)
                clock.sleep_until(clock.now() + _PERIOD)
            device.write(ZERO)
            return [
                way / push if push > 0.0 else 0.0 for way, push in zip(ways, pushes, strict=True)
            ]
    finally:
        device.close()


def verdict(name: str, ways: list[float]) -> str:
    """Say in one sentence whether a device pushes in the right direction.

    Args:
        ways: Displacement of the tip along the push in each knock, as `pulse` returns it [m].

    Raises:
        DeviceError: The tip moved against every knock: an object would pull it in.
    """
    most = 1e3 * max(ways, key=abs)
    if all(way < -CLEAR for way in ways):
        raise DeviceError(
            name,
            f"it moved against each of its knocks, by {-most:.1f} mm: an object would pull it in",
            "hold it loosely and try again; if it does so again, turn round the direction of its "
            "motor in the file of the unit, and touch nothing with it before",
        )
    if all(way > CLEAR for way in ways):
        return f"it moved with each of its knocks, by {most:.1f} mm: it pushes where it should"
    return "it moved too little to tell whether it pushes where it should; hold it loosely for that"


_Device = Annotated[
    str,
    typer.Argument(help="NAME or NAME:KEY=VALUE,KEY=VALUE, as `cohaptic devices` prints it."),
]

devices = typer.Typer(
    help="Find haptic devices, and try them.",
    invoke_without_command=True,
)


@devices.callback()
def listed(context: typer.Context) -> None:
    """List the devices that are found, and how each is chosen."""
    if context.invoked_subcommand is not None:
        return
    found, _ = search()
    for each in found:
        trouble = f"  ({each.problem})" if each.problem else ""
        typer.echo(f"--device {each.choice}    {each.where}{trouble}")
    if not found:
        typer.echo("no device was found; `cohaptic doctor` says where it has looked")
    typer.echo("--device simulated    always there")


@devices.command("pulse", cls=ChapterCommand)
def knock(device: _Device) -> None:
    """Knock gently on the hand at a device, to see which it is."""
    choice = read_device(device)
    if choice.name == "simulated":
        raise SettingError("device", "simulated", "a device that a hand holds: haply, touch, ...")
    config = DeviceConfig(choice, ZERO, 0.1, Hand(), None)
    direction = device_kind(choice.name).knock(choice)
    typer.echo(verdict(choice.name, pulse(open_device(config), SystemClock(), direction)))


@devices.command(cls=ChapterCommand)
def calibrate(device: _Device) -> None:
    """Measure a device with your help, and print its unit's file."""
    choice = read_device(device)
    run = device_kind(choice.name).calibrate
    if run is None:
        raise SettingError("device", choice.name, "one that is calibrated so: oneaxis")
    # Questions go to stderr, so that stdout has only the file and `> FILE` writes it.
    lines = run(choice, SystemClock(), _ask)
    typer.echo("\n".join(lines))


@devices.command(cls=ChapterCommand)
def options(
    name: Annotated[str, typer.Argument(help=f"One of {', '.join(names())}.")],
) -> None:
    """List the options that may follow the name of a device."""
    kind = device_kind(name)
    typer.echo(f"{name}: {kind.summary}")
    for key, meaning in kind.options:
        typer.echo(f"  {key}: {meaning}")


def _ask(what: str) -> None:
    # typer.prompt would treat Ctrl-C as a missing answer and exit with status 1 instead of 130.
    typer.echo(f"{what}, then press Enter: ", err=True, nl=False)
    if not sys.stdin.readline():
        raise typer.Abort
