"""`cohaptic touch`: reads the command's options and runs a client with them."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cohaptic.cli.network import DelayMs, JitterMs, Network, injected
from cohaptic.cli.output import Output, Overwrite, new_output
from cohaptic.control.law import DEFAULT_LAW, Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.errors import SettingError
from cohaptic.room_address import room_url
from cohaptic.runtime.new_file import is_stream
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import HandScript, Place, Rhythm
from cohaptic.vec import Vec3
from cohaptic_client.devices.catalogue import names, read_device

if TYPE_CHECKING:
    from cohaptic.protocol.messages import FixedGains, GeometryName


# s; a server of the balloon listens 1 s after its start, or 3 s on a busy machine.
_WAIT = 5.0

# Panels of the help, after the options that most people need.
_HAND = "Simulated hand (--device simulated)"
_DEVICE, _NETWORK, _LAW = "Device", "Connection", "Local model, for experiments"


class Shape(Enum):
    """Geometry of the local surface; the value is its word on the command line."""

    PLANE = "plane"
    SPHERE = "sphere"
    MESH = "mesh"


_GEOMETRY: dict[Shape, GeometryName] = {
    Shape.PLANE: "plane",
    Shape.SPHERE: "sphere",
    Shape.MESH: "mesh",
}


# Long, because each option of the command is a parameter.
def touch(
    url: Annotated[
        str, typer.Argument(help="Address of the server, or the link of an invitation.")
    ] = "ws://127.0.0.1:8765",
    room: Annotated[
        str, typer.Option(help="Room of a server that has several: the same as URL/r/ROOM.")
    ] = "",
    name: Annotated[str, typer.Option(help="The name that the others see.")] = "guest",
    device: Annotated[
        str, typer.Option(metavar="NAME[:OPTIONS]", help=f"The device: {', '.join(names())}.")
    ] = "simulated",
    law: Annotated[Law, typer.Option(help="Control law of the local model.")] = DEFAULT_LAW,
    friction: Annotated[float, typer.Option(help="Coefficient of friction, 0 (none) to 2.")] = 0.0,
    max_force: Annotated[float, typer.Option(help="Largest force on the hand [N].")] = 10.0,
    rule: Annotated[
        list[str] | None,
        typer.Option(help="A rule of another package in the loop; may be given again."),
    ] = None,
    network: Network = "",
    delay_ms: DelayMs = None,
    jitter_ms: JitterMs = None,
    record: Annotated[
        Path | None,
        typer.Option(
            help="Write every haptic period to this new file: a session (.mcap), or an .npz."
        ),
    ] = None,
    overwrite: Overwrite = False,
    duration: Annotated[
        float | None, typer.Option(help="Leave after this time [s].", show_default="Ctrl-C")
    ] = None,
    wait_seat: Annotated[
        bool, typer.Option("--wait-seat", help="Wait for a place where the room is full.")
    ] = False,
    angle: Annotated[
        float,
        typer.Option(
            help="Where it stands, seen from above, from the right counter-clockwise [deg].",
            rich_help_panel=_HAND,
        ),
    ] = 180.0,
    depth_mm: Annotated[
        float, typer.Option(help="How deep it intends to press [mm].", rich_help_panel=_HAND)
    ] = 15.0,
    rhythm_s: Annotated[
        float,
        typer.Option(
            help="Period in which it presses and lets go [s]; 0 keeps pressing.",
            rich_help_panel=_HAND,
        ),
    ] = 0.0,
    drag_mm: Annotated[
        float,
        typer.Option(
            help="Way that it drags to its right and back in place of letting go [mm].",
            rich_help_panel=_HAND,
        ),
    ] = 0.0,
    at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y Z",
            help="Point on the surface, in place of --angle, in the frame of its file [m].",
            rich_help_panel=_HAND,
        ),
    ] = None,
    inward: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y Z",
            help="With --at: unit vector into the body there.",
            rich_help_panel=_HAND,
        ),
    ] = None,
    dead_man: Annotated[
        bool,
        typer.Option(
            help="Give force only while the device's switch is held, where it has one.",
            rich_help_panel=_DEVICE,
        ),
    ] = True,
    hold_faults: Annotated[
        bool | None,
        typer.Option(
            help="After a fault keep the force off until Enter is pressed, and not only until the "
            "hand has left the object.",
            show_default="for devices with motors",
            rich_help_panel=_DEVICE,
        ),
    ] = None,
    loop_hz: Annotated[
        float,
        typer.Option(help="Rate of the haptic loop, 500 to 4000 [Hz].", rich_help_panel=_DEVICE),
    ] = 1000.0,
    token: Annotated[
        str,
        typer.Option(
            envvar="COHAPTIC_TOKEN",
            show_default=False,
            show_envvar=True,
            help="Token of an invitation. Other users of this machine see options of a command, "
            "but not the variable.",
            rich_help_panel=_NETWORK,
        ),
    ] = "",
    ca_file: Annotated[
        Path | None,
        typer.Option(
            help="Certificates that vouch for the server, for wss://.", rich_help_panel=_NETWORK
        ),
    ] = None,
    insecure: Annotated[
        bool,
        typer.Option("--insecure", help="Send a token without TLS.", rich_help_panel=_NETWORK),
    ] = False,
    wait: Annotated[
        float | None,
        typer.Option(
            help="How long to try to reach the server, at first and after losing it [s].",
            show_default=f"{_WAIT:g} at first, and without end after losing it",
            rich_help_panel=_NETWORK,
        ),
    ] = None,
    delay_up_ms: Annotated[
        float | None,
        typer.Option(
            help="Delay towards the server, in place of --delay-ms [ms].", rich_help_panel=_NETWORK
        ),
    ] = None,
    delay_down_ms: Annotated[
        float | None,
        typer.Option(
            help="Delay from the server, in place of --delay-ms [ms].", rich_help_panel=_NETWORK
        ),
    ] = None,
    jitter_up_ms: Annotated[
        float | None,
        typer.Option(
            help="Jitter towards the server, in place of --jitter-ms [ms].",
            rich_help_panel=_NETWORK,
        ),
    ] = None,
    jitter_down_ms: Annotated[
        float | None,
        typer.Option(
            help="Jitter from the server, in place of --jitter-ms [ms].", rich_help_panel=_NETWORK
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(help="Seed of the random jitter.", rich_help_panel=_NETWORK)
    ] = 0,
    json_lines: Annotated[
        bool,
        typer.Option(
            "--json-lines", help="Print the state as lines of JSON.", rich_help_panel=_NETWORK
        ),
    ] = False,
    geometry: Annotated[
        Shape,
        typer.Option(help="Local surface between two patches.", rich_help_panel=_LAW),
    ] = Shape.MESH,
    passivity: Annotated[
        bool,
        typer.Option(
            help="Dissipate by damping the energy that the delay generates.", rich_help_panel=_LAW
        ),
    ] = True,
    models: Annotated[
        bool,
        typer.Option(
            help="Move models of the other hands, which answer at once.", rich_help_panel=_LAW
        ),
    ] = True,
    smoothing: Annotated[
        float,
        typer.Option(
            help="Share of a tick over which a new patch is taken in; 0 as in the paper.",
            rich_help_panel=_LAW,
        ),
    ] = 1.0,
    k_h: Annotated[
        float | None,
        typer.Option(
            help="Gain in place of the server's; needs serve --allow-fixed-gains [N/m].",
            rich_help_panel=_LAW,
        ),
    ] = None,
    integral_gain: Annotated[
        float,
        typer.Option(help="Integral gain I, with --k-h only [N/(m s)].", rich_help_panel=_LAW),
    ] = 0.0,
    threshold_mm: Annotated[
        float | None,
        typer.Option(
            help="Error that pi tolerates, eq. (17) [mm].",
            show_default="eq. (18), 0.2 mm going in and 1 mm coming out",
            rich_help_panel=_LAW,
        ),
    ] = None,
    lifeline: Annotated[bool, typer.Option("--lifeline", hidden=True)] = False,
) -> None:
    """Touch the object of a server; Ctrl-C ends it with zero force."""

    recording = _recording(record, overwrite=overwrite)

    def link(delay: float | None, jitter: float | None, salt: int) -> LinkSettings:
        one_way = delay_ms if delay is None else delay
        extra = jitter_ms if jitter is None else jitter
        return replace(injected(network, one_way, extra), seed=2 * seed + salt)

    up, down = link(delay_up_ms, jitter_up_ms, 0), link(delay_down_ms, jitter_down_ms, 1)
    # Imported here, so that the help and errors in option values need not wait for these imports.
    from cohaptic.runtime.interrupt import run
    from cohaptic_client.address import read_address
    from cohaptic_client.settings import ClientSettings
    from cohaptic_client.touching import touching

    address = read_address(url)
    settings = ClientSettings(
        url=room_url(address.url, room),
        token=address.token or token,
        ca_file=str(ca_file or ""),
        insecure=insecure,
        dead_man=dead_man,
        hold_faults=hold_faults,
        wait_seat=wait_seat,
        name=name,
        law=law,
        fixed_gains=_fixed_gains(k_h, integral_gain),
        thresholds=_thresholds(threshold_mm),
        smoothing=smoothing,
        friction=friction,
        rules=tuple(rule or ()),
        passivity=passivity,
        models=models,
        geometry=_GEOMETRY[geometry],
        device=read_device(device),
        loop_hz=loop_hz,
        max_force=max_force,
        up=up,
        down=down,
        script=HandScript(
            angle=math.radians(angle),
            place=_place(at, inward),
            depth=1e-3 * depth_mm,
            rhythm=Rhythm(rhythm_s) if rhythm_s else None,
            drag=1e-3 * drag_mm,
            approach_at=0.0,  # time after the safety layer has engaged the hand
        ),
        patience=_WAIT if wait is None else wait,
        patience_lost=math.inf if wait is None else None,
        duration=duration,
    )
    run(touching(settings, recording, json_lines), lifeline=lifeline)


SUFFIX = ".mcap"  # of a session file


def _recording(path: Path | None, *, overwrite: bool) -> Output | None:
    """Return the file of a recording, which has to be a plain file.

    Raises:
        SettingError: It cannot be made, or must not be replaced.
    """
    if path is not None and path.suffix == SUFFIX:
        if overwrite:
            raise SettingError("--overwrite", "given", f"left out: nothing replaces a {SUFFIX}")
        if path.exists():
            raise SettingError("--record", path, f"a new file: nothing replaces a {SUFFIX}")
        return new_output("--record", path, SUFFIX)
    recording = new_output("--record", path, ".npz", overwrite=overwrite)
    if recording is not None and is_stream(recording.path):
        raise SettingError("--record", path, "a file, and it is a device or a pipe")
    return recording


def _place(at: Vec3 | None, inward: Vec3 | None) -> Place | None:
    if at is None or inward is None:
        if at is not inward:
            raise SettingError("--at", at, "given together with --inward")
        return None
    return Place(at, inward)


def _fixed_gains(k_h: float | None, integral_gain: float) -> FixedGains | None:
    if k_h is None:
        if integral_gain != 0.0:
            raise SettingError("integral gain", integral_gain, "given together with --k-h")
        return None
    from pydantic import ValidationError

    from cohaptic.protocol.messages import FixedGains

    try:
        return FixedGains(k_h=k_h, integral_gain=integral_gain)
    except ValidationError as error:
        limit = "K_h above 0, at most 1e6 N/m, and I from 0 to 1e9 N/(m s)"
        raise SettingError("gains", f"{k_h:g} N/m, {integral_gain:g} N/(m s)", limit) from error


def _thresholds(millimetres: float | None) -> Thresholds:
    """Return the thresholds of eq. (17) for a value [mm], or those of eq. (18) for None."""
    if millimetres is None:
        return Thresholds()
    if not 0.0 <= millimetres <= 50.0:
        raise SettingError("threshold", f"{millimetres:g} mm", "from 0 to 50 mm")
    return Thresholds(1e-3 * millimetres, 1e-3 * millimetres, 0.0)
