"""Writes what is made from the chains of loop and tick: tables in the docs, names for the page.

python tools/life_of_a_force.py        # or `make life`
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from types import ModuleType

import cohaptic_client.loop
import cohaptic_server.world
from cohaptic.recording.why import ENTRIES
from cohaptic.recording.why import TICK as OF_TICK
from cohaptic_client.loop.chain import CHAIN as LOOP
from cohaptic_server.world.stages.chain import CHAIN as TICK

ROOT = Path(__file__).parents[1]
PAGE, CODE = ROOT / "docs/life-of-a-force.md", ROOT / "web/src/model/rules.ts"
END = "<!-- end of the chain -->\n"


def value_of(constant: str, package: ModuleType) -> float:
    """Return the value of a constant, by its name or as a default of a class.

    Args:
        constant: Its name in a module of the package, or class and field.
        package: Where it is looked for.

    Raises:
        LookupError: No module of the package has it.
    """
    owner, _, field = constant.rpartition(".")
    for info in walk_packages(package.__path__, f"{package.__name__}."):
        if info.ispkg or ".running." in info.name:
            continue
        module = import_module(info.name)
        if not hasattr(module, owner or field):
            continue
        if not owner:
            return float(getattr(module, field))
        return float(inspect.signature(getattr(module, owner)).parameters[field].default)
    raise LookupError(f"no module of {package.__name__} has {constant}")


Line = tuple[str, str, str, Callable[..., object]]


def table(first: str, lines: Iterable[Line], package: ModuleType) -> str:
    """Return the table of a chain, as Markdown.

    Args:
        first: Head of the first column.
        lines: Name, reason, constant and code of each rule.
        package: Where constants are looked for.
    """
    found = [f"| {first} | what it does, and why | constant | where |", "|---|---|---|---|"]
    for rule, why, of, code in lines:
        name, _, unit = of.partition(" ")
        constant = f"`{name}` = {value_of(name, package):g} {unit}".rstrip() if name else "none"
        where = code.__module__.replace(".", "/") + ".py"
        found.append(
            f"| {rule} | {why[0].upper()}{why[1:]} | {constant} | `{where}`, `{code.__name__}` |"
        )
    return "\n".join(found) + "\n"


def tables() -> dict[str, str]:
    """Return the tables by the mark behind which each stands."""
    loop = [(rule.name, rule.reason, rule.constant, type(rule)) for rule in LOOP]
    tick = [(stage.name, stage.reason, stage.constant, stage.run) for stage in TICK]
    return {
        "<!-- chain: written by `make life` -->\n": table("rule", loop, cohaptic_client.loop),
        "<!-- stages: written by `make life` -->\n": table("stage", tick, cohaptic_server.world),
    }


def written(page: str) -> str:
    """Return the page with the tables of today.

    Args:
        page: Text of the page, with its marks.

    Raises:
        ValueError: It has lost one.
    """
    for begin, text in tables().items():
        before, found, rest = page.partition(begin)
        _, end, after = rest.partition(END)
        if not found or not end:
            raise ValueError(f"{PAGE.name} has lost a mark: {begin.strip()} or {END.strip()}")
        page = f"{before}{begin}\n{text}\n{END}{after}"
    return page


def typescript() -> str:
    """Return what the browser page knows of the loop's chain and ledger, as a module of its own."""
    rules = {rule.name: rule.reason for rule in LOOP}
    entries = {name.removeprefix("by_"): words for name, words in ENTRIES.items()}
    ticks = {name.replace("tick_", "by_"): words for name, words in OF_TICK.items()}
    return f"""\
// Made by `make life` from the chain of the Python client and the words of its ledger.

/** Rules of the loop in their order, with what each does and why. */
export const RULES = {_literal(rules)} as const;
export type RuleName = keyof typeof RULES;
export const RULE_NAMES = {json.dumps(list(rules))} as const;

/** Entries of a ledger in the order of the rules, with what they are; they are the whole force. */
export const ENTRIES = {_literal(entries)} as const;
export type EntryName = keyof typeof ENTRIES;

/** What the server's tick makes of the force that it has heard of, with what each entry is. */
export const TICK = {_literal(ticks)} as const;
"""


def _literal(words: Mapping[str, str]) -> str:
    """Return a mapping from names to words as an object of TypeScript."""
    lines = [f"  {name}: {json.dumps(text, ensure_ascii=False)},\n" for name, text in words.items()]
    return f"{{\n{''.join(lines)}}}"


if __name__ == "__main__":
    CODE.write_text(typescript(), encoding="utf-8")
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
