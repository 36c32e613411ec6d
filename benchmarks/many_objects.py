"""A folder of meshes, each prepared at the first try and touched by two hands: a nightly table.

    python examples/make_objects.py --many FOLDER
    python benchmarks/many_objects.py FOLDER [--kinds linear limb ...] [--only NAME ...]
        [--jobs 2] [--json F]

Each file goes through `cohaptic body prepare FILE --auto` in a process of its own, with an empty
store, a limit of time and one of memory; then two hands press it at 0, 80 and 250 ms each way
(`object_session.py`), where a demonstration puts them or, `limb`, both on its softest part. Of each
session the table has the worst error of the force on a hand, and on a linear object that of the
part of it that the other hand causes, off and pressed, against the equilibrium of hands and object;
a session that does not come to rest says so, and so does one whose forces are more than 2 % off at
any time after a wait for ten more ways round. `force` is the one with which the first hand presses,
and `felt` the share of it that the other hand feels, both in the equilibrium. `table` is the share
of vertices whose tabulated compliance is within 5 % of a press there, and the worst error.

The exit status is 1 where a file is neither accepted nor refused in a sentence, or a session fails,
is unstable, ends with a force more than 2 % off, or has less than 0.05 N to be felt.
`--options='--fix "z < 15%"'` has other options of an object than `--auto`.
"""

from __future__ import annotations

import json
import math
import re
import shlex
import signal
import sys
import tempfile
import threading
from argparse import ArgumentParser, Namespace
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import json_report
from cohaptic_server.touchable import KINDS
from cohaptic_tools.demo.lateness import LEAST
from cohaptic_tools.demo.rest import Rest
from limited import Ended, run_limited

SESSIONS = Path(__file__).with_name("object_session.py")
# Largest error of a force of a session that counts as sound, of the demonstration's own claim.
LARGEST_ERROR = 0.02
_READY = re.compile(r": ([\d,]+) tetrahedra, .*; ready in ")
_KINDS = {
    "linear": (),
    "limb": ("--limb",),
    "nonlinear": ("--nonlinear",),
    "nonlinear-limb": ("--nonlinear", "--limb"),
}

Row = dict[str, Any]


def try_file(
    path: Path, chosen: Sequence[str], options: Namespace, ends: threading.Event | None = None
) -> Row:
    """Prepare one file and play its sessions; everything that is known of it, in SI units.

    Args:
        path: The mesh.
        chosen: Options of an object, `--auto` among them or not.
        options: Options of the command line.
        ends: Set when the night ends early.
    """
    with tempfile.TemporaryDirectory() as cache:
        env = {"COHAPTIC_CACHE": cache, "COLUMNS": "1000", "NO_COLOR": "1"}
        command = [sys.executable, "-m", "cohaptic", "body", "prepare", str(path), *chosen]
        limits = {"seconds": options.limit_seconds, "memory": options.limit_memory}
        ended = run_limited(command, env=env, ends=ends, **limits)
        row: Row = {"file": path.name, "seconds": ended.seconds, "memory_bytes": ended.memory}
        row["processor_seconds"] = ended.processor
        row |= judge(ended)
        if row["verdict"] != "accepted":
            return row
        for kind in options.kinds:
            command = [sys.executable, str(SESSIONS), str(path), *chosen, *_KINDS[kind]]
            limits["seconds"] = options.limit_session_seconds
            row[kind] = sessions_of(run_limited(command, env=env, ends=ends, **limits))
    return row


def judge(ended: Ended) -> Row:
    """`verdict` on a preparation: accepted, refused, stopped or crashed; and what it said.

    Args:
        ended: The end of `cohaptic body prepare`.
    """
    said = [line.strip() for line in ended.out.splitlines() if line.strip()]
    ready = [match for line in said if (match := _READY.search(line))]
    if ended.over:
        return {"verdict": "stopped", "said": ended.over}
    if ended.code == 0 and ready:
        changes = [line for line in said if not _READY.search(line)]
        tetrahedra = int(ready[0][1].replace(",", ""))
        return {"verdict": "accepted", "said": "; ".join(changes), "tetrahedra": tetrahedra}
    sentence = " ".join(ended.err.split())
    if ended.code == 2 and sentence.startswith("cohaptic: ") and "Traceback" not in sentence:
        return {"verdict": "refused", "said": sentence.removeprefix("cohaptic: ")}
    last = ended.err.strip().splitlines()[-1:] or ["without a word"]
    return {"verdict": "crashed", "said": f"ended with {ended.code}: {last[0]}"}


def sessions_of(ended: Ended) -> Row:
    """What `object_session.py` found, or its `error` in a sentence."""
    lines = ended.out.strip().splitlines()
    if ended.code == 0 and not ended.over and lines:
        found: Row = json.loads(lines[-1])
        return found
    last = ended.err.strip().splitlines()[-1:] or ["without a word"]
    return {"sessions": [], "error": ended.over or f"ended with {ended.code}: {last[0]}"}


def is_sound(row: Row) -> bool:
    """Whether a file was refused in a sentence, or its sessions are stable, right and felt."""
    if row["verdict"] != "accepted":
        return bool(row["verdict"] == "refused")
    kinds = [row[kind] for kind in _KINDS if kind in row]
    sessions = [session for kind in kinds for session in kind["sessions"]]
    good = all(
        session["rest"] != Rest.UNSTABLE.value
        and min(session["press_n"], session["felt_n"]) >= LEAST
        and max(session["force_error"], session["late_error"]) <= LARGEST_ERROR
        for session in sessions
    )
    return good and not any("error" in kind for kind in kinds)


def cells(row: Row, kinds: Sequence[str]) -> list[str]:
    """One row of the printed table."""
    memory = row["memory_bytes"]
    line = [
        row["file"],
        row["verdict"],
        f"{row['seconds']:.1f} s",
        f"{row['processor_seconds']:.1f} s",
        "" if math.isnan(memory) else f"{1e-6 * memory:,.0f} MB",
        f"{row['tetrahedra']:,}" if "tetrahedra" in row else "",
    ]
    for kind in kinds:
        found = row.get(kind, {"sessions": []})
        played = [_session_cell(session, kind) for session in found["sessions"]]
        line += [*played, *[""] * (3 - len(played)), *_strength_cells(found["sessions"])]
    table: Row = next((row[kind] for kind in ("linear", "limb") if kind in row), Row())
    fraction = table.get("share_within_5_percent")
    line.append("" if fraction is None else f"{fraction:.0%}, {table['worst_error']:.0%}")
    said = [row["said"]]
    errors = {kind: row[kind]["error"] for kind in _KINDS if "error" in row.get(kind, {})}
    said += [f"{kind} sessions: {error}" for kind, error in errors.items()]
    return [*line, "; ".join(part.replace("|", "/") for part in said if part)]


def _strength_cells(sessions: Sequence[Row]) -> list[str]:
    """The force of the press, and the share of it that is felt: the same at every delay."""
    if not sessions:
        return ["", ""]
    press, felt = sessions[0]["press_n"], sessions[0]["felt_n"]
    return [f"{press:.2g} N", f"{felt / press:.0%}" if press else ""]


def _session_cell(session: Row, kind: str) -> str:
    errors = f"{100 * session['force_error']:.2g}"
    if not kind.startswith("nonlinear"):
        # In rubber a force alone is no product of its tangent, by which the reference takes it.
        errors += f" / {100 * session['felt_error']:.2g}"
    # What it is later is told where it would not be sound.
    later = session["late_error"]
    errors += f", later {100 * later:.2g}" if later > LARGEST_ERROR else ""
    return f"{errors} %" + ("" if session["rest"] == Rest.RESTS.value else f" {session['rest']}")


def files_in(folder: Path, only: Sequence[str]) -> list[Path]:
    """The meshes of a folder in order, or those of them that are named, with suffix or without."""
    if not folder.is_dir():
        raise SystemExit(f"{folder}: there is no such folder")
    found = [path for path in sorted(folder.iterdir()) if path.name.lower().endswith(KINDS)]
    names = {path: {path.name, path.name.split(".")[0]} for path in found}  # phantom.nii.gz
    missing = [name for name in only if not any(name in each for each in names.values())]
    if missing or not found:
        raise SystemExit(f"{folder}: there is no mesh {' and no '.join(missing) or 'in it'}")
    return [path for path in found if not only or names[path].intersection(only)]


def _tried(
    paths: Sequence[Path], chosen: Sequence[str], options: Namespace
) -> Generator[Row, None, None]:
    """The row of each file as it ends, `options.jobs` of them at a time."""
    ends = threading.Event()
    with ThreadPoolExecutor(max(1, options.jobs)) as pool:
        try:
            found = [pool.submit(try_file, path, chosen, options, ends) for path in paths]
            for future in as_completed(found):
                yield future.result()
        finally:
            ends.set()  # whoever ends the night ends what it started too
            pool.shutdown(cancel_futures=True)


def _parser() -> ArgumentParser:
    parser = json_report.parser(__doc__)
    parser.add_argument("folder", type=Path)
    kinds = "how each is touched: as a linear solid or as rubber, both hands on its softest part"
    parser.add_argument("--kinds", nargs="+", default=["linear"], choices=_KINDS, help=kinds)
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these files")
    parser.add_argument("--limit-seconds", type=float, default=120.0, help="to prepare one")
    parser.add_argument("--limit-memory", type=float, default=2e9, help="of one process, in bytes")
    parser.add_argument(
        "--limit-session-seconds", type=float, default=600.0, help="for the sessions of one"
    )
    jobs = "files at a time; more than one make times and memory those of a busy machine"
    parser.add_argument("--jobs", type=int, default=1, help=jobs)
    parser.add_argument("--options", default="--auto", help="of an object, in place of --auto")
    return parser


def _end(number: int, frame: object) -> None:
    sys.exit(128 + number)


def main() -> None:
    """Print a table while it is measured."""
    options = _parser().parse_args()
    # As an exception it passes `_tried`, which ends what runs.
    signal.signal(signal.SIGTERM, _end)
    chosen = shlex.split(options.options)
    names = ["file", "verdict", "prepared in", "processor", "memory", "tetrahedra"]
    columns = ("0 ms", "80 ms", "250 ms", "force", "felt")
    names += [f"{kind} {column}" for kind in options.kinds for column in columns]
    names += ["table", "changed, or why not"]
    print(f"| {' | '.join(names)} |\n|{'---|' * len(names)}", flush=True)
    rows: list[Row] = []
    for row in _tried(files_in(options.folder, options.only), chosen, options):
        rows.append(row)
        print(f"| {' | '.join(cells(row, options.kinds))} |", flush=True)
        # So that a night cut short leaves what it had.
        json_report.write(options, sorted(rows, key=lambda row: str(row["file"])))
    count = {v: sum(row["verdict"] == v for row in rows) for v in ("accepted", "refused")}
    unsound = [row["file"] for row in rows if not is_sound(row)]
    print(
        f"\n{len(rows)} files: {count['accepted']} accepted, {count['refused']} refused in a"
        f" sentence; {'not sound: ' + ', '.join(unsound) if unsound else 'all are sound'}"
    )
    sys.exit(1 if unsound else 0)


if __name__ == "__main__":
    main()
