"""The command `cohaptic experiment`: the paper's figures and further experiments."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cohaptic.cli.output import Overwrite
from cohaptic_experiments.catalogue import Experiment, choose, extra_libraries, in_words, load
from cohaptic_experiments.outcome import Options, Outcome
from cohaptic_experiments.report import Files, files, progress_bar, show, write


def experiment(
    name: Annotated[str, typer.Argument(help=f"{in_words()}; or all.")],
    out: Annotated[Path, typer.Option(help="Folder for figures, data and summaries.")] = Path(
        "results"
    ),
    overwrite: Overwrite = False,
    seed: Annotated[int, typer.Option(min=0, help="Of everything that is random.")] = 0,
    quick: Annotated[bool, typer.Option(help="Shorter and coarser, to see that it works.")] = False,
    trials: Annotated[
        int, typer.Option(min=10, max=100_000, help="Of the campaign `hands`.")
    ] = 2000,
    trial: Annotated[
        int | None, typer.Option(min=0, help="Of `hands`: draw this trial only.")
    ] = None,
    cluster: Annotated[
        str, typer.Option(metavar="HOST:PORT", help="Of `hands`: run on a cluster's machines.")
    ] = "",
) -> None:
    """Make a figure of the theory, and check it.

    Writes OUT/NAME/figure.png, data.csv and summary.json. Ends with status 1 when a verdict is
    that something does not hold.
    """
    names = choose(name)
    written = {each: files(out / each, overwrite=overwrite) for each in names}
    options = Options(seed, quick, trials, trial, cluster)
    console = Console()
    failed: list[str] = []
    for each in names:
        chosen = load(each)
        outcome = _run(chosen, options, written[each])
        console.print(show(chosen, outcome))
        if not outcome.holds:
            failed.append(each)
    console.print(f"written to {out}", highlight=False)
    if failed:
        console.print(f"[bold red]does not hold:[/] {', '.join(failed)}", highlight=False)
        raise typer.Exit(1)


def _run(chosen: Experiment, options: Options, to: Files) -> Outcome:
    """Run one experiment under a progress bar, and write its outcome."""
    with extra_libraries(), progress_bar() as bar:
        from cohaptic_experiments.plot_style import styled

        task = bar.add_task(chosen.name, total=1.0)

        def progress(fraction: float) -> None:
            bar.update(task, completed=fraction)

        with styled():
            outcome = chosen.run(options, progress)
            write(chosen, options, outcome, to)
    return outcome
