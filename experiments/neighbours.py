"""Make the table of the campaign's rooms, in which the page looks up those like its own.

    python experiments/neighbours.py [--rooms 2000] [--seed 0] [--json FILE]

Runs every room under five variants (the predictive law on devices that damp 8 or 0 N s/m, the
integral and the proportional one, and the paper's rule), 8 s of haptics each; the 10,000 take some
minutes of one core. Writes web/src/control/campaign_rooms.json, or FILE.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from cohaptic_experiments.campaign.neighbours import RULES, SECONDS, Outcome, table

ROOT = Path(__file__).parents[1]
FILE = ROOT / "web/src/control/campaign_rooms.json"


def written(seed: int, rooms: int, found: dict[str, list[list[int]]]) -> str:
    """The table as JSON, a line for each rule and number of hands."""
    head = {
        "command": f"python experiments/neighbours.py --rooms {rooms} --seed {seed}",
        "rooms": rooms,
        "variants": {rule: len(variants) for rule, variants in RULES.items()},
        "seconds": SECONDS,
        "columns": list(Outcome._fields),
    }
    lines = [f"  {json.dumps(name)}: {json.dumps(value)}," for name, value in head.items()]
    rules = ",\n".join(
        f"    {json.dumps(rule)}: [\n"
        + ",\n".join("      " + json.dumps(row, separators=(",", ":")) for row in rows)
        + "\n    ]"
        for rule, rows in found.items()
    )
    return "{\n" + "\n".join(lines) + '\n  "outcomes": {\n' + rules + "\n  }\n}\n"


def main() -> None:
    """Run the rooms and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--rooms", type=int, default=2000, help="of each variant")
    parser.add_argument("--seed", type=int, default=0, help="of the ensemble")
    parser.add_argument("--json", type=Path, default=FILE, help="file to write")
    options = parser.parse_args()

    def progress(fraction: float) -> None:
        print(f"\r{100 * fraction:3.0f} %", end="", file=sys.stderr, flush=True)

    text = written(options.seed, options.rooms, table(options.seed, options.rooms, progress))
    options.json.write_text(text)
    print(f"\rwritten to {options.json}, {len(text)} bytes", file=sys.stderr)


if __name__ == "__main__":
    main()
