"""Whether two trees give the same forces, bit for bit.

    python tools/golden.py since REVISION      # this tree against a commit
    python tools/golden.py record FOLDER       # what the sessions of this tree give
    python tools/golden.py compare BEFORE AFTER
    python tools/golden.py keep                # after a change that was meant to move forces

The sessions are in `golden_sessions.py`. Bits depend on the machine and its libraries, so both
trees are played on one machine. `keep` writes tests/vectors/golden.json, a force every 50 ms, with
which `make test` compares within a tolerance.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from golden_sessions import LENGTH, SESSIONS, Trace, play

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "tests/vectors/golden.json"
EVERY = 50  # haptic periods between two forces that are kept
_DIGITS = 5  # of a kept force after the point [N]; far below what a hand feels
_COMPILED = Path("shared/cohaptic/_compiled")
_SIDES = ("shared", "server", "client", "experiments", "tools", ".")


def record(folder: Path, seconds: float = LENGTH) -> None:
    """Play every session and write what came of it, a file each.

    Args:
        folder: Made if it is not there.
        seconds: Length of a session [s].
    """
    folder.mkdir(parents=True, exist_ok=True)
    for seed, (name, _, _) in enumerate(SESSIONS):
        print(f"{seed + 1} of {len(SESSIONS)}: {name}", flush=True)
        write(folder / f"{name}.npz", play(seed, seconds))


def write(file: Path, traces: Sequence[Trace]) -> None:
    """Write the traces of a session."""
    arrays = {
        f"{what} of user {k}": array
        for k, trace in enumerate(traces)
        for what, array in (
            ("force", trace.force),
            ("felt", trace.felt),
            ("patches", np.frombuffer(trace.patches, dtype=np.uint8)),
        )
    }
    np.savez_compressed(file, allow_pickle=False, **arrays)


def differences(before: Path, after: Path) -> list[str]:
    """Sentences on all that differs by a bit; empty if nothing does.

    Args:
        before: A folder that `record` wrote.
        after: Another.
    """
    names = sorted({file.name for folder in (before, after) for file in folder.glob("*.npz")})
    if not names:
        return [f"no sessions in {before} and {after}"]
    return [line for name in names for line in _of_session(before / name, after / name)]


def _of_session(before: Path, after: Path) -> list[str]:
    absent = [file for file in (before, after) if not file.is_file()]
    if absent:
        return [f"{before.stem}: {absent[0]} is missing"]
    with np.load(before) as one, np.load(after) as two:
        if set(one.files) != set(two.files):
            return [f"{before.stem}: other users"]
        found = [(name, _first_difference(one[name], two[name])) for name in one.files]
    return [f"{before.stem}, {name}: {how}" for name, how in found if how]


def _first_difference(one: np.ndarray, two: np.ndarray) -> str:
    """Where two arrays differ first, and by how much in all; empty where they are alike."""
    if one.shape != two.shape:
        return f"{len(one)} before, {len(two)} after"
    if one.tobytes() == two.tobytes():
        return ""
    # By their bits: 0.0 and -0.0 are equal, and two that are no numbers are not.
    bits = [
        np.ascontiguousarray(array).view(np.uint8).reshape(len(one), -1) for array in (one, two)
    ]
    rows = np.flatnonzero((bits[0] != bits[1]).any(axis=1))
    if one.dtype == np.uint8:
        return f"differ from byte {rows[0]:,} of {len(one):,} on"
    largest = float(np.abs(one - two).max())
    return f"differs from {1e-3 * rows[0]:.3f} s on, by {largest:.2g} N at most"


def since(revision: str) -> list[str]:
    """What differs between a commit and this tree; both are played here and now.

    Args:
        revision: Revision of git.

    Raises:
        SystemExit: The revision is unknown, or has no sessions.
    """
    with tempfile.TemporaryDirectory(prefix="cohaptic-golden-") as folder:
        tree, before, after = (Path(folder) / name for name in ("tree", "before", "after"))
        _unpack(revision, tree)
        # What is the same in both trees need not be compiled again.
        if (ROOT / _COMPILED).is_dir():
            shutil.copytree(ROOT / _COMPILED, tree / _COMPILED, dirs_exist_ok=True)
        for root, into in ((tree, before), (ROOT, after)):
            print(f"\n== {revision if root is tree else 'this tree'}", flush=True)
            path = os.pathsep.join(str(root / side) for side in _SIDES)
            environment = {**os.environ, "PYTHONPATH": path}
            # Where there is no compiler both are plain.
            subprocess.run([sys.executable, "-m", "compiling"], cwd=root, env=environment)
            command = [sys.executable, str(root / "tools/golden.py"), "record", str(into)]
            subprocess.run(command, cwd=root, env=environment, check=True)
        return differences(before, after)


def _unpack(revision: str, tree: Path) -> None:
    asked = ["git", "archive", "--format=tar", revision]
    archive = subprocess.run(asked, cwd=ROOT, capture_output=True)
    if archive.returncode:
        raise SystemExit(archive.stderr.decode().strip())
    with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as files:
        files.extractall(tree, filter="data")
    if not (tree / "tools/golden.py").is_file():
        raise SystemExit(f"{revision} has no sessions to compare with: it is older than they are")


def samples(trace: Trace) -> list[list[float]]:
    """Some of the forces of a user, rounded, shape (n, 3) [N]."""
    # Without -0.0, which is the same force.
    rounded: list[list[float]] = (np.round(trace.force[::EVERY], _DIGITS) + 0.0).tolist()
    return rounded


def keep() -> None:
    """Write the forces that `make test` compares with."""
    kept = {name: [samples(t) for t in play(seed)] for seed, (name, _, _) in enumerate(SESSIONS)}
    # A line for each user.
    sessions = [
        f' "{name}": [\n  ' + ",\n  ".join(json.dumps(user) for user in users) + "\n ]"
        for name, users in kept.items()
    ]
    KEPT.write_text("{\n" + ",\n".join(sessions) + "\n}\n", encoding="utf-8")


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="python tools/golden.py", description=(__doc__ or "").splitlines()[0]
    )
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("since", help="this tree against a commit").add_argument("revision")
    commands.add_parser("record", help="what this tree gives").add_argument("folder", type=Path)
    two = commands.add_parser("compare", help="two folders that `record` wrote")
    two.add_argument("before", type=Path)
    two.add_argument("after", type=Path)
    commands.add_parser("keep", help=f"write {KEPT.relative_to(ROOT)}")
    asked = parser.parse_args()
    if asked.command == "record":
        record(asked.folder)
    elif asked.command == "keep":
        keep()
    else:
        alike = asked.command == "since"
        found = since(asked.revision) if alike else differences(asked.before, asked.after)
        print("\n".join(found) or f"{len(SESSIONS)} sessions are alike, bit for bit")
        sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
