"""Command line of the searches for the worst attack; `--json FILE` keeps what was found."""

from __future__ import annotations

import argparse
import json
import random
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Final

from cohaptic_experiments.attacks import liars, links, servers
from cohaptic_experiments.attacks.search import Found, search
from cohaptic_experiments.attacks.victims import VICTIMS, Harm
from cohaptic_server.bodies.balloon.balloon import Balloon

_SPEEDS: Final = (0.05, 0.1, 0.3, 0.5)  # m/s, of a hand before it rests
_RESTS: Final = (2, 10, 20, 30, 50, 100, 400)  # ms for which it has rested
# Stiffness [N/m] and largest force [N] of the device, and stiffness of the object [N/m].
_OBJECTS: Final = (
    (400.0, 3.3, 250.0),
    (2000.0, 10.0, 250.0),
    (2000.0, 10.0, 2000.0),
    (8000.0, 12.0, 2000.0),
)
_ATTACK: Final = 120  # ms
_STILL: Final = 0.05  # N


def _by_liars(
    seed: int, runs: int, kinds: tuple[str, ...], seconds: float, *, models: bool
) -> dict[str, Found]:
    stage = liars.Stage(Balloon(), kinds, models=models)

    def play(liar: liars.Liar) -> dict[str, float]:
        found = liars.attacked(stage, liar, seconds)
        return {
            f"{kind} {name}": value
            for kind, harm in found.items()
            for name, value in harm._asdict().items()
        }

    return search(play, liars.draw, liars.alter, runs, random.Random(seed))


def co_users(runs: int, seed: int, kinds: tuple[str, ...], seconds: float, processes: int) -> Any:
    """Print the worst of each measure with and without models; return it for a file."""
    result: dict[str, Any] = {"runs": runs, "seed": seed, "seconds": seconds}
    tables: dict[bool, dict[str, Found]] = {}
    seeds = [seed * 1000 + k for k in range(processes)]
    for models in (True, False):
        play = partial(_by_liars, runs=-(-runs // processes), kinds=kinds, seconds=seconds,
                       models=models)  # fmt: skip
        with ProcessPoolExecutor(processes) as pool:
            found = list(pool.map(play, seeds))
        tables[models] = {
            name: max((one[name] for one in found), key=lambda best: best.value)
            for name in found[0]
        }
    print(f"the worst of {runs} liars each, {seconds:g} s: with models (without)")
    for kind in kinds:
        words = [
            f"{name} {tables[True][f'{kind} {name}'].value:.3g}"
            f" ({tables[False][f'{kind} {name}'].value:.3g})"
            for name in Harm._fields
        ]
        print(f"{kind:10s} " + ", ".join(words))
    for models, table in tables.items():
        result["models" if models else "plain"] = {
            name: {"value": best.value, "attack": asdict(best.attack)}
            for name, best in table.items()
        }
    return result


def _searched(hand: servers.Attacked, runs: int, seed: int, periods: int, way: str) -> list[float]:
    play = partial(servers.attacked, hand, periods=periods, way=way)
    best = search(play, servers.draw, servers.alter, runs, random.Random(seed))
    return [best["step"].value, best["climb"].value]


def lying_servers(runs: int, seed: int) -> Any:
    """Print the largest changes of the force on hands that rest and that move; return them."""
    result: dict[str, Any] = {"runs": runs, "seed": seed, "rest": {}, "moving": {}}
    print("device N/m, object N/m, speed before m/s; rest ms: change in 1 ms, in 20 ms [N]")
    for stiffness, force, of in _OBJECTS:
        for speed in _SPEEDS:
            row: dict[int, list[float]] = {}
            for rest in _RESTS:
                hand = servers.rested((stiffness, force), of, speed, rest)
                row[rest] = _searched(hand, runs, seed, _ATTACK, "still")
            words = "  ".join(f"{rest}: {a:.3f} {b:.2f}" for rest, (a, b) in row.items())
            print(f"{stiffness:.0f} {of:.0f} {speed:g}: {words}", flush=True)
            result["rest"][f"{stiffness:g} {of:g} {speed:g}"] = row
    print("\nhand that moves, device N/m, damping N s/m: change in 1 ms, in 20 ms [N]")
    for way in servers.WAYS:
        for stiffness, force in servers.DEVICES:
            for damping in (0.0, 8.0):
                hand = servers.Attacked(stiffness, force, damping)
                hand.press(0.1)
                hand.rest(300)
                a, b = _searched(hand, runs, seed, 700, way)
                print(f"{way}, {stiffness:.0f}, {damping:g}: {a:.3f} {b:.2f}", flush=True)
                result["moving"][f"{way}, {stiffness:g}, {damping:g}"] = [a, b]
    return result


def _rests(room: links.Room) -> tuple[float, float]:
    return links.still(room), links.still(room, models=False)


def on_links(runs: int, seed: int, processes: int) -> Any:
    """Print rooms whose forces do not rest; return what all did, with and without models."""
    rooms, found = [links.draw(1000 * seed + k) for k in range(runs)], list[Any]()
    print(f"forces that change by more than {_STILL} N after 4 s of rest: with models (without)")
    with ProcessPoolExecutor(processes) as pool:
        for room, (models, plain) in zip(rooms, pool.map(_rests, rooms), strict=True):
            found.append(asdict(room) | {"models": models, "plain": plain})
            if models > _STILL:
                print(f"{room}: {models:.3f} ({plain:.3f})", flush=True)
    restless = [one for one in found if one["models"] > max(_STILL, one["plain"])]
    print(f"{len(restless)} of {runs} rooms, where the same is not so without models")
    return {"runs": runs, "seed": seed, "rooms": found}


def main(arguments: Sequence[str]) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m cohaptic_experiments.attacks")
    parser.add_argument("who", choices=("co-users", "servers", "links"))
    parser.add_argument("--runs", type=int, default=100, help="attacks in each search")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--victims", default="clamped,light", help=", ".join(VICTIMS))
    parser.add_argument("--seconds", type=float, default=2.5, help="of each attack by co-users")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--json", type=Path, help="file for what was found")
    given = parser.parse_args(arguments)
    if given.who == "co-users":
        kinds = tuple(given.victims.split(","))
        found = co_users(given.runs, given.seed, kinds, given.seconds, given.processes)
    elif given.who == "links":
        found = on_links(given.runs, given.seed, given.processes)
    else:
        found = lying_servers(given.runs, given.seed)
    if given.json is not None:
        given.json.write_text(json.dumps(found, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
