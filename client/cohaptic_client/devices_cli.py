"""`cohaptic devices`: lists devices and their options, knocks with a device, calibrates it."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from cohaptic.cli.app import ChapterCommand
from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError, SettingError
from cohaptic.simulated.hand import Hand
from cohaptic.vec import ZERO
from cohaptic_client.devices.catalogue import device_kind, names, open_device, read_device, search
from cohaptic_client.devices.kind import DeviceConfig, nothing_found
from cohaptic_client.devices.pulse import pulse, verdict

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
    for name in names():
        try:
            sought = device_kind(name).find is not nothing_found
        except CohapticError as error:  # of a package that somebody else has written
            typer.echo(str(error))
            continue
        if not sought and name != "simulated":
            typer.echo(f"--device {name}    is not looked for: choose it where it is there")
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
