"""Make docs/results.md and its pictures again: scenes, experiments, then both benchmarks.

    python experiments/results.py [--quick] [--keep DIR]

Takes about half an hour on an idle machine, most of it the campaign `hands`; nothing else should
run meanwhile. `--keep DIR` writes each part there as soon as it is done, and takes what is there
already as it is: a run that was ended goes on. `--quick` shortens every part, to see that it works;
its figures are not for the page.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cohaptic_experiments.catalogue import EXPERIMENTS

ROOT = Path(__file__).parents[1]
PAGE = """# Results

Made by `make results` on {machine}. Timings depend on the machine and its load; forces, errors
and stability do not.

## Users who feel each other

`python experiments/demo_scenes.py`: each row is one `cohaptic demo` with real processes,
websockets and injected delay. The first user presses and releases; the others rest round the
balloon.

- *felt by right*, *reference*: the part of the force on `right` that the others cause, and the
  same in the equilibrium of body and hands, solved without a network.
- *worst error*: largest relative difference of the two over all users.
- *half*, *90 %*: by how much later half and nine tenths of the change of force are felt than by
  the same hands simulated without a network (slowest hand, median over presses). *inf*: the force
  on some hand changes by less than 0.05 N.
- *both ways*: from the first hand to the server and on to another, the least possible delay.
- *lag*: time constant with which the object answers the others.
- *stable*: at rest a force ripples by at most 0.02 N or 1 %; *slow*: a force still creeps, or its
  swings still die out, when the next press comes.

{scenes}

![forces of both hands, 80 ms each way](pictures/two-users.png)

The proportional law loses most of the other hand's force: its gain has to stay below
1 / sum_j |C_ij|, and the hand feels K_h and K_o in series (eq. (11)). The integral of `pi` restores
the force long after the surface has moved. With the predictive law the steady force equals the
reference, and the others' forces arrive behind a short lag (science 3.13).

## The paper's figures, and further experiments

`cohaptic experiment all --out DIR`, or `cohaptic experiment NAME --out DIR --seed 0`: every loop is
the real room, world, wire format and client, with simulated hands, in virtual time. A verdict holds
if each of its checks does; all of them hold.

{experiments}

## The haptic loop

`python benchmarks/loop.py`: *late* is the time from the moment a period was due to its start;
*ratio* is the p99 of the haptic loop over that of each loop that only sleeps, at the same priority
in the same rounds; *missed* are periods skipped because the one before was too late; *core* is
processor time.

{loop}

## The server's tick

`python benchmarks/tick.py`: users with mesh patches press 1 N each and slide along the equator at
0.2 m/s, so that every tick searches and solves every contact anew.

{tick}

[Where the time goes](performance.md) has the costs part by part, and how they grow.
"""
_REPEATED = 5  # checks of one quantity, from which on they have a table of their own


def output(*command: str) -> str:
    """Standard output of a script."""
    print("running", *command, file=sys.stderr)
    done = subprocess.run(
        [sys.executable, *command], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True
    )
    return done.stdout.strip()


def part(folder: Path, name: str, *command: str) -> str:
    """Standard output of a script, kept in a file of the folder."""
    kept = folder / f"{name}.md"
    if not kept.exists():
        text = output(*command)
        kept.write_text(text)
    return kept.read_text()


def experiments(folder: Path, quick: bool) -> str:
    """Run the experiments that are not in the folder yet; figures, and checks as Markdown."""
    pictures = ROOT / "docs/pictures/experiments"
    pictures.mkdir(exist_ok=True, parents=True)
    parts: list[str] = []
    for name in EXPERIMENTS:
        if not (folder / name / "summary.json").exists():
            # Its own tables go to the terminal; a verdict that does not hold ends this as well.
            command = [sys.executable, "-m", "cohaptic", "experiment", name, "--out", str(folder)]
            options = ["--seed", "0", *(["--quick"] if quick else [])]
            subprocess.run([*command, *options], stdout=sys.stderr, check=True)
        shutil.copy(folder / name / "figure.png", pictures / f"{name}.png")
        said = json.loads((folder / name / "summary.json").read_text())
        parts.append(
            f"### {name}: {said['title']}\n\n![{name}](pictures/experiments/{name}.png)\n\n"
            + tables(said["checks"])
        )
    return "\n\n".join(parts)


def tables(checks: Sequence[dict[str, Any]]) -> str:
    """The checks as Markdown; quantities of many ensembles in a table of their own."""
    named = [(*check["sentence"].rpartition(": ")[::2], check) for check in checks]
    count = Counter(quantity for _, quantity, _ in named)
    rows = ["| check | measured | limit |", "|---|---|---|"]
    of_ensembles: dict[str, dict[str, str]] = {}
    for ensemble, quantity, check in named:
        if count[quantity] < _REPEATED:
            rows.append(f"| {check['sentence']} | {check['measured']:.3g} | {limit(check)} |")
        else:
            cell = f"{check['measured']:.3g} ({limit(check)})"
            of_ensembles.setdefault(ensemble, {})[quantity] = cell
    if of_ensembles:
        repeated = [quantity for quantity in count if count[quantity] >= _REPEATED]
        rows += ["", f"| ensemble | {' | '.join(repeated)} |", "|---" * len(repeated) + "|---|"]
        for ensemble, found in of_ensembles.items():
            cells = (found.get(quantity, "") for quantity in repeated)
            rows.append(f"| {ensemble} | {' | '.join(cells)} |")
    return "\n".join(rows)


def limit(check: dict[str, Any]) -> str:
    """The limits of a check, in words."""
    low, high = check["at_least"], check["at_most"]
    if low is None:
        return f"at most {high:.3g}"
    return f"at least {low:.3g}" if high is None else f"{low:.3g} to {high:.3g}"


def main() -> None:
    """Run everything and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="shorten every part")
    parser.add_argument("--keep", type=Path, help="folder of parts; what is there is not run again")
    options = parser.parse_args()
    quick = options.quick
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        seconds = "7" if quick else "12"
        scenes = part(
            folder, "scenes",
            "experiments/demo_scenes.py", "--out", str(folder), "--seconds", seconds,
        )  # fmt: skip
        outcomes = experiments(folder, quick)
        loop = part(folder, "loop", "benchmarks/loop.py", "--rounds", "1" if quick else "5")
        tick = part(folder, "tick", "benchmarks/tick.py", "--ticks", "30" if quick else "400")
        pictures = ROOT / "docs/pictures"
        pictures.mkdir(exist_ok=True)
        shutil.copy(folder / "two-users.png", pictures)
    machine = f"{os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"
    page = PAGE.format(machine=machine, scenes=scenes, experiments=outcomes, loop=loop, tick=tick)
    (ROOT / "docs/results.md").write_text(page)


if __name__ == "__main__":
    main()
