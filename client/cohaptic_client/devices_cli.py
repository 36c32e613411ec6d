"""`cohaptic devices`: what is here, what keeps it from use, and which of two is which."""

from __future__ import annotations

import contextlib
import sys
from importlib.metadata import PackageNotFoundError, version

import typer

from cohaptic.cli.chapters import ChapterCommand
from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError, SettingError
from cohaptic.simulated.hand import Hand
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import NAMES, device_kind, open_device, read_device
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.hid_devices import unknown_hid
from cohaptic_client.devices.kind import Found
from cohaptic_client.devices.pulse import pulse, verdict
from cohaptic_client.devices.serial_ports import unknown_ports

# Of Python, that drivers use; what it is for.
_LIBRARIES = (
    ("hidapi", "HID devices"),
    ("pyserial", "serial boards"),
    ("websockets", "the Haply service"),
)

devices = typer.Typer(
    help="Find haptic devices, and what keeps one from use.",
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
        typer.echo("no device was found; `cohaptic devices doctor` says where it has looked")
    typer.echo("--device simulated    always there")


@devices.command(cls=ChapterCommand)
def doctor() -> None:
    """Say what is wrong with a device or driver, and what to do."""
    for name, purpose in _LIBRARIES:
        typer.echo(f"{name} {_version(name)}, for {purpose}")
    found, missing = search()
    for each in found:
        typer.echo(f"{each.choice}, {each.where}: {each.problem or 'ready'}")
        if each.problem:
            typer.echo(f"  to do: {each.advice}")
    for error in missing:
        typer.echo(f"{error.device}: {error.problem}")
        if error.advice:
            typer.echo(f"  to do: {error.advice}")
    seen = {each.choice.split(":")[0] for each in found} | {error.device for error in missing}
    absent = [name for name in NAMES if name not in seen and name != "simulated"]
    if absent:
        typer.echo(f"not plugged in, or not seen by the system: {', '.join(absent)}")
    places = [each.where for each in found]
    for unknown in (unknown_hid, unknown_ports):
        with contextlib.suppress(DeviceError):  # without its library, which was told above
            for other in unknown(places):
                typer.echo(f"seen, and known to no driver here: {other}")
    if any(each.problem for each in found):
        raise typer.Exit(1)


@devices.command("pulse", cls=ChapterCommand)
def knock(device: str) -> None:
    """Knock gently on the hand at a device, to see which it is."""
    choice = read_device(device)
    if choice.name == "simulated":
        raise SettingError("device", "simulated", "a device that a hand holds: haply, touch, ...")
    config = DeviceConfig(choice, ZERO, 0.1, Hand(), None)
    direction = device_kind(choice.name).knock(choice)
    typer.echo(verdict(choice.name, pulse(open_device(config), SystemClock(), direction)))


@devices.command(cls=ChapterCommand)
def calibrate(device: str) -> None:
    """Measure a device with your help, and print its unit's file."""
    choice = read_device(device)
    run = device_kind(choice.name).calibrate
    if run is None:
        raise SettingError("device", choice.name, "one that is calibrated so: oneaxis")
    # What is asked goes beside what is printed, so that the file can be written by `> FILE`.
    lines = run(choice, SystemClock(), _ask)
    typer.echo("\n".join(lines))


@devices.command(cls=ChapterCommand)
def options(name: str) -> None:
    """List the options that may follow the name of a device."""
    kind = device_kind(name)
    typer.echo(f"{name}: {kind.summary}")
    for key, meaning in kind.options:
        typer.echo(f"  {key}: {meaning}")


def search() -> tuple[list[Found], list[DeviceError]]:
    """Devices of this machine, and what was missing to look for others."""
    found: list[Found] = []
    missing: list[DeviceError] = []
    for name in NAMES:
        try:
            found += device_kind(name).find()
        except DeviceError as error:
            missing.append(error)
    return found, missing


def _ask(what: str) -> None:
    # Not typer.prompt, which takes Ctrl-C for an answer that is missing: status 1 in place of 130.
    typer.echo(f"{what}, then press Enter: ", err=True, nl=False)
    if not sys.stdin.readline():
        raise typer.Abort


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "is not installed"
