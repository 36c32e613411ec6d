"""The scenes by which the product is judged, run on the real server and clients, as a table.

    python experiments/demo_scenes.py [--out out] [--seconds 12]

Each scene is one `cohaptic demo`: processes, websockets, injected delay. Prints a table in Markdown
and writes every result (JSON), the recordings, and a picture of the first scene to the folder.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

SCENES = [
    ("predictive", 80, 2),
    ("predictive", 0, 2),
    ("predictive", 250, 2),
    ("predictive", 80, 4),
    ("predictive", 80, 6),
    ("pi", 80, 2),
    ("proportional", 0, 2),
    ("proportional", 80, 2),
    ("proportional", 250, 2),
    ("proportional", 80, 4),
]
HEAD = (
    "law|one way|users|lag|stable|felt by right|reference|worst error|half|90 %|both ways|loop"
    "|late p99"
).split("|")


def run(law: str, delay_ms: int, users: int, seconds: float, folder: Path) -> dict[str, Any]:
    """One scene; returns its JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    result = folder / "result.json"
    command = [sys.executable, "-m", "cohaptic", "demo", "--law", law, "--users", str(users)]
    command += ["--delay-ms", str(delay_ms), "--duration", str(seconds)]
    command += ["--json", str(result), "--keep", str(folder), "--overwrite"]
    # An unstable scene ends with 1, and its result is still one.
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if not result.exists():
        raise SystemExit(f"{law}, {delay_ms} ms, {users} users: {done.stdout}{done.stderr}")
    loaded: dict[str, Any] = json.loads(result.read_text())
    return loaded


def row(result: dict[str, Any]) -> str:
    """One line of the table."""
    users = result["users"]
    # Those who wait; the first hand makes the change itself.
    late = {
        fraction: max(math.inf if user[fraction] is None else user[fraction] for user in users[1:])
        for fraction in ("felt_delay_ms", "felt_most_ms")
    }
    errors = [user["force_error"] for user in users]
    if None in errors:
        raise SystemExit(f"no verdict: {json.dumps(result)}")
    ways = 2 * result["delay_ms"]
    rest = {user["rest"] for user in users}
    right = users[1]
    cells = [
        result["law"],
        f"{result['delay_ms']:g} ms",
        str(len(users)),
        f"{result['lag_ms']:.0f} ms",
        "NO" if "unstable" in rest else "slow" if "slow" in rest else "yes",
        f"{right['felt_from_others_n']:.3f} N",
        f"{right['truth_from_others_n']:.3f} N",
        f"{max(errors):.2%}",
        f"{late['felt_delay_ms']:.0f} ms",
        f"{late['felt_most_ms']:.0f} ms",
        f"{ways:g} ms",
        f"{min(user['loop_hz'] for user in users):.0f} Hz",
        f"{max(user['loop_late_p99_us'] for user in users):.0f} us",
    ]
    return "| " + " | ".join(cells) + " |"


def picture(folder: Path, target: Path) -> None:
    """Forces of both hands over one press, from the recordings of a scene."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    from cohaptic_tools.demo.analysis import Recording, Timeline

    timeline = Timeline.of([Recording.load(folder / f"{name}.npz") for name in ("left", "right")])
    level = timeline.columns["level"][0]
    press = int((level > 0.0).argmax())
    window = slice(max(0, press - 700), press + 1800)
    t = 1e3 * (timeline.t[window] - timeline.t[press])
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(8.0, 5.0), sharex=True, dpi=120)
    top.plot(t, timeline.force[0, window], color="#c2410c", label="left presses")
    top.plot(t, timeline.force[1, window], color="#1d4ed8", label="right rests, and feels it")
    top.set_ylabel("force on the hand [N]")
    top.legend(frameon=False)
    felt = timeline.felt[:, window]
    bottom.plot(t, felt[0], color="#c2410c", label="left feels of right")
    bottom.plot(t, felt[1], color="#1d4ed8", label="right feels of left")
    bottom.set_ylabel("felt of the other [N]")
    bottom.set_xlabel("time since left began to press [ms]; 80 ms each way")
    bottom.legend(frameon=False)
    for axes in (top, bottom):
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    figure.align_ylabels()
    figure.tight_layout()
    figure.savefig(str(target))  # pyright: ignore[reportUnknownMemberType]


def main() -> None:
    """Run every scene."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for everything")
    parser.add_argument("--seconds", type=float, default=12.0, help="of each scene")
    arguments = parser.parse_args()
    print("| " + " | ".join(HEAD) + " |")
    print("|---" * len(HEAD) + "|")
    for law, delay_ms, users in SCENES:
        folder = arguments.out / f"{law}-{delay_ms}ms-{users}users"
        print(f"running {folder.name} ...", file=sys.stderr)
        print(row(run(law, delay_ms, users, arguments.seconds, folder)), flush=True)
    first = arguments.out / "predictive-80ms-2users"
    picture(first, arguments.out / "two-users.png")


if __name__ == "__main__":
    main()
