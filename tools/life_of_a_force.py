"""Writes the table of the loop's chain in docs/life-of-a-force.md from the chain itself.

python tools/life_of_a_force.py        # or `make life`
"""

from __future__ import annotations

import inspect
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import cohaptic_client.loop
from cohaptic_client.loop.chain import CHAIN

PAGE = Path(__file__).parents[1] / "docs/life-of-a-force.md"
BEGIN, END = "<!-- chain: written by `make life` -->\n", "<!-- end of the chain -->\n"


def value_of(constant: str) -> float:
    """Return the value of a constant of the loop, by its name or as a default of a class.

    Raises:
        LookupError: No module of the loop has it.
    """
    owner, _, field = constant.rpartition(".")
    for info in iter_modules(cohaptic_client.loop.__path__, "cohaptic_client.loop."):
        if info.ispkg:
            continue
        module = import_module(info.name)
        if not hasattr(module, owner or field):
            continue
        if not owner:
            return float(getattr(module, field))
        return float(inspect.signature(getattr(module, owner)).parameters[field].default)
    raise LookupError(f"no module of the loop has {constant}")


def table() -> str:
    """Return the table of the chain, as Markdown."""
    lines = ["| rule | what it does, and why | constant | where |", "|---|---|---|---|"]
    for rule in CHAIN:
        name, _, unit = rule.constant.partition(" ")
        constant = f"`{name}` = {value_of(name):g} {unit}".rstrip() if name else "none"
        where = type(rule).__module__.replace(".", "/") + ".py"
        reason = rule.reason[0].upper() + rule.reason[1:]
        lines.append(
            f"| {rule.name} | {reason} | {constant} | `{where}`, `{type(rule).__name__}` |"
        )
    return "\n".join(lines) + "\n"


def written(page: str) -> str:
    """Return the page with the table of today.

    Args:
        page: Text of the page, with the two marks.

    Raises:
        ValueError: It has not both marks.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{PAGE.name} has lost a mark: {BEGIN.strip()} or {END.strip()}")
    return f"{before}{BEGIN}\n{table()}\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
