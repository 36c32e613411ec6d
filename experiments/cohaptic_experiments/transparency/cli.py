"""The command `cohaptic bench transparency`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cohaptic.cli.app import ChapterCommand
from cohaptic.cli.network import JitterMs
from cohaptic.cli.output import Overwrite, new_output
from cohaptic.control.law import Law
from cohaptic.simulated.networks import NETWORKS

bench = typer.Typer(help="Measure what the network does to touch.", no_args_is_help=True)


@bench.callback()
def measure() -> None:
    """Measure what the network does to touch."""


# Long, because each option of the command is a parameter.
@bench.command(cls=ChapterCommand)
def transparency(
    law: Annotated[
        list[Law] | None, typer.Option(help="Control law.", show_default="predictive")
    ] = None,
    delay_ms: Annotated[
        list[float] | None,
        typer.Option(help="Delay, each way [ms].", show_default="0, 80, 250, or that of --network"),
    ] = None,
    network: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WORDS",
            help=f"Network: {', '.join(NETWORKS)}; or as delay=80,jitter=40,loss=1.",
        ),
    ] = None,
    jitter_ms: JitterMs = None,
    loss: Annotated[
        float | None,
        typer.Option(help="Messages that are lost and repeated [%].", show_default=False),
    ] = None,
    late_ticks: Annotated[
        float, typer.Option(help="Ticks that come one or two periods late [%].")
    ] = 0.0,
    seed: Annotated[int, typer.Option(help="Seed of the network's draws.")] = 0,
    users: Annotated[
        list[int] | None, typer.Option(help="Hands, 2 to 16.", show_default="2")
    ] = None,
    preset: Annotated[
        list[str] | None,
        typer.Option(help="Device of the hands that rest.", show_default="rig"),
    ] = None,
    hand: Annotated[
        list[str] | None,
        typer.Option(
            help="Mechanics of all hands: kg, N s/m, N/m.",
            metavar="M,B,K",
            show_default="0.15,8,400",
        ),
    ] = None,
    simulation_hz: Annotated[
        float, typer.Option("--simulation-hz", "--hz", help="Ticks, 10 to 200 [Hz].")
    ] = 60.0,
    models: Annotated[
        bool, typer.Option(help="Clients move models of the hands, which answer at once.")
    ] = True,
    together: Annotated[
        bool, typer.Option("--together", help="All hands touch at the same instant.")
    ] = False,
    budget: Annotated[
        bool, typer.Option("--budget", help="Measure the parts of the delay, too; much slower.")
    ] = False,
    json: Annotated[Path | None, typer.Option(help="Write the results to this file.")] = None,
    out: Annotated[Path | None, typer.Option(help="Draw the results to this PNG.")] = None,
    overwrite: Overwrite = False,
) -> None:
    """Measure what one hand feels of another, and how late.

    Hands come to the balloon one after the other and rest pressed into it, in virtual time, with
    the real room, frames and haptic loops. The first one sways by eleven sines at once, and then
    presses. All is divided by the truth: the same hands, simulated without a network. Then it sways
    at 1 Hz: how rough that is felt. Options may be given several times; all combinations are
    measured.
    """
    json_output = new_output("--json", json, overwrite=overwrite)
    picture = new_output("--out", out, ".png", overwrite=overwrite)
    from cohaptic_experiments.transparency.command import Grid, links_of, read_hand, run
    from cohaptic_experiments.transparency.setting import USUAL

    grid = Grid(
        tuple(law or [Law.PREDICTIVE]),
        links_of(network or [], delay_ms or [], jitter_ms, loss, seed),
        tuple(users or [2]),
        tuple(preset or ["rig"]),
        simulation_hz,
        models,
        tuple(map(read_hand, hand)) if hand else (USUAL,),
        together,
        1e-2 * late_ticks,
    )
    run(grid, budget=budget, json_file=json_output, picture_file=picture)
