"""`cohaptic devices`: what is here, what keeps it from use, and which of two is which."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

import typer

from cohaptic.clock import SystemClock
from cohaptic.errors import DeviceError, SettingError
from cohaptic.simulated.hand import Hand
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import NAMES, device_kind, open_device, read_device
from cohaptic_client.devices.device_config import DeviceConfig
from cohaptic_client.devices.kind import Found
from cohaptic_client.devices.pulse import pulse

# Of Python, that drivers use; what it is for.
_LIBRARIES = (
    ("hidapi", "HID devices"),
    ("pyserial", "serial boards"),
    ("websockets", "the Haply service"),
)

devices = typer.Typer(
    help="Find haptic devices of this machine, and say what keeps one from use.",
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


@devices.command()
def doctor() -> None:
    """Say of every device, driver and service what is wrong, and what to do about it."""
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
    if any(each.problem for each in found):
        raise typer.Exit(1)


@devices.command("pulse")
def knock(device: str) -> None:
    """Knock three times, gently, on the hand at DEVICE, to tell it from another."""
    choice = read_device(device)
    if choice.name == "simulated":
        raise SettingError("device", "simulated", "one that is there")
    config = DeviceConfig(choice, ZERO, 0.1, Hand(), None)
    pulse(open_device(config), SystemClock())


@devices.command()
def options(name: str) -> None:
    """Say what can be told of the device NAME after a colon, as KEY=VALUE,KEY=VALUE."""
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


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "is not installed"
