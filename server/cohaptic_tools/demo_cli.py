"""Command `cohaptic demo`, which shows several simulated hands on one object."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from cohaptic.cli.network import JitterMs, Network, injected
from cohaptic.cli.output import Overwrite
from cohaptic.control.law import DEFAULT_LAW, Law
from cohaptic_server.cli.object_options import ObjectOptions, takes_object
from cohaptic_server.touchable import BALLOON

Duration = Annotated[
    float | None,
    typer.Option(help="How long [s].", show_default="until Ctrl-C; 15 without a terminal"),
]
Friction = Annotated[
    float,
    typer.Option(help="Coefficient of friction; above 0 one finger drags another."),
]
_RUN = "Run and results"  # chapter of the help, after the options that most people need
Seed = Annotated[int, typer.Option(help="Seed of the network's draws.", rich_help_panel=_RUN)]
Json = Annotated[
    Path | None, typer.Option(help="Write the result to this file.", rich_help_panel=_RUN)
]
Keep = Annotated[
    Path | None,
    typer.Option(help="Keep recordings and logs in this folder.", rich_help_panel=_RUN),
]
NoBrowser = Annotated[
    bool,
    typer.Option(
        "--no-browser", help="Do not open the page, only say where it is.", rich_help_panel=_RUN
    ),
]

Strict = Annotated[
    bool,
    typer.Option(
        "--strict",
        help="End with status 1 too if a force was not judged, or is more than 5 % off.",
        rich_help_panel=_RUN,
    ),
]


# Long, because each option of the command is a parameter.
@takes_object
def demo(
    duration: Duration = None,
    users: Annotated[int, typer.Option(help="Hands, 2 to 16.")] = 2,
    network: Network = "",
    delay_ms: Annotated[
        float | None,
        typer.Option(help="Delay each way; 80 without --network [ms].", show_default=False),
    ] = None,
    jitter_ms: JitterMs = None,
    law: Annotated[Law, typer.Option(help="Control law.")] = DEFAULT_LAW,
    friction: Friction = 0.0,
    simulation_hz: Annotated[
        float | None,
        typer.Option(
            "--simulation-hz",
            "--hz",
            help="Rate of the simulation, 10 to 200 [Hz].",
            show_default="60, or 30 where the machine does not keep up with 60",
        ),
    ] = None,
    seed: Seed = 0,
    body: Annotated[
        str,
        typer.Option(
            help="The object: balloon, or a mesh file, on which hands stand where they feel each"
            " other."
        ),
    ] = BALLOON,
    nonlinear: Annotated[bool, typer.Option("--nonlinear", help="Large deformation.")] = False,
    *,
    options: ObjectOptions,
    json: Json = None,
    keep: Keep = None,
    overwrite: Overwrite = False,
    no_browser: NoBrowser = False,
    strict: Strict = False,
) -> None:
    """Watch hands feel each other in one object, with delay.

    A server and simulated users run as separate processes on this machine. The first user presses
    and releases; the others rest on the body and feel it. At the end the forces are compared
    with the truth: body and hands in equilibrium, without any network.

    With --friction, 0.8 for a dry fingertip, two stand side by side and stick: the first drags the
    skin of the balloon along and back, and the second feels the force along the surface.

    The status is 1 if a force swung although patches and haptic periods came on time, or if the
    first two hands did not feel each other. Where the machine or the link kept a force from being
    judged, the result says so, and the status is 0.
    """
    from cohaptic.simulated.networks import words_for
    from cohaptic_tools.demo.demonstration import demonstrate
    from cohaptic_tools.demo.scene import USUAL, Scene

    scene = Scene(
        users, injected(network or words_for(USUAL), delay_ms, jitter_ms), law, seed=seed,
        duration=duration, friction=friction,
    )  # fmt: skip
    browser = not no_browser
    result = demonstrate(
        scene, simulation_hz, body, options, json, keep,
        overwrite=overwrite, nonlinear=nonlinear, browser=browser,
    )  # fmt: skip
    if not (result.proves_it if strict else result.shows_it):
        sys.exit(1)
