"""A copy of the checkout in a temporary folder, and pytest in it.

The copy has what git knows or would take, so changes that are not committed are in it, and nothing
that was compiled. It stands first on the path of every process that is started in it. Bytecode is
checked by the hash of its source: by time and size, a fault of the same second and size would not
be seen.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from mutant_making import Mutant
from mutant_plugin import CHOSEN, MODULE, REPORT

SIDES = ("shared", "server", "client", "experiments")
TIMED_OUT = -1000  # no signal has this number


class Session(NamedTuple):
    """What came of a session of pytest.

    Args:
        code: Exit status, or TIMED_OUT.
        tests: Seconds and outcome of each test, in the order in which they ran.
        collected: Names of all tests that were to be run.
        output: Output of pytest.
    """

    code: int
    tests: dict[str, tuple[float, str]]
    collected: list[str]
    output: str

    @property
    def failed(self) -> str:
        """The first test that failed; empty if none did."""
        return next((name for name, (_, how) in self.tests.items() if how == "failed"), "")


class Checkout:
    """A copy that may be changed, to be made in an empty folder."""

    def __init__(self, original: Path, folder: Path) -> None:
        self.root = folder / "checkout"
        self._report, self._chosen = folder / "report.json", folder / "chosen.txt"
        self._output = folder / "output.txt"
        for name in known_files(original):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(original / name, self.root / name, follow_symlinks=False)
        compiled = [sys.executable, "-m", "compileall", "-q", "--invalidation-mode", "checked-hash"]
        subprocess.run([*compiled, *SIDES], cwd=self.root, env=self._environment({}), check=True)

    def mutate(self, mutant: Mutant) -> None:
        """Put the fault in."""
        path = self.root / mutant.path
        path.write_bytes(mutant.applied(path.read_bytes()))

    def restore(self, mutant: Mutant, source: bytes) -> None:
        """Take the fault out."""
        (self.root / mutant.path).write_bytes(source)

    def chosen(
        self, names: Iterable[str], arguments: Iterable[str], limit: float, mutated: str = ""
    ) -> Session:
        """Run tests by their names; see `pytest`."""
        names = list(names)
        self._chosen.write_text("\n".join(names), encoding="utf-8")
        files = dict.fromkeys(name.partition("::")[0] for name in names)
        environment = {CHOSEN: str(self._chosen)}
        return self.pytest([*arguments, *files], environment, limit, mutated)

    def pytest(
        self,
        arguments: Iterable[str],
        environment: Mapping[str, str],
        limit: float | None = None,
        mutated: str = "",
    ) -> Session:
        """Run pytest in the copy.

        Args:
            arguments: Arguments of pytest.
            environment: Beside what every session gets.
            limit: Time after which it is ended, with the processes of its group [s].
            mutated: Path of the source with the fault.

        Raises:
            RuntimeError: Another file was imported than the one with the fault.
        """
        command = [sys.executable, "-m", "pytest", "-p", "mutant_plugin", "-p", "no:cacheprovider"]
        environment = {**environment, REPORT: str(self._report)}
        if mutated:
            environment[MODULE] = module_name(mutated)
        self._report.unlink(missing_ok=True)
        with self._output.open("w") as output:
            process = subprocess.Popen(
                [*command, *arguments],
                cwd=self.root,
                env=self._environment(environment),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                code = process.wait(limit)
            except subprocess.TimeoutExpired:
                code = TIMED_OUT
            finally:
                end_group(process)
        said = self._output.read_text(errors="replace")
        if not self._report.is_file():
            return Session(code, {}, [], said)
        found: dict[str, Any] = json.loads(self._report.read_text(encoding="utf-8"))
        if mutated and found["imported"] != str(self.root / mutated):
            raise RuntimeError(f"tests imported {found['imported']}, and not {mutated} of the copy")
        return Session(code, found["tests"], found["collected"], said)

    def _environment(self, more: Mapping[str, str]) -> dict[str, str]:
        path = os.pathsep.join(str(self.root / side) for side in (*SIDES, "tools", "."))
        own = {"PYTHONPATH": path, "COHAPTIC_PLAIN": "1", "HYPOTHESIS_PROFILE": "quick"}
        kept = {name: os.environ[name] for name in os.environ if name != "PYTHONDONTWRITEBYTECODE"}
        return {**kept, **own, **more}


def known_files(root: Path) -> list[str]:
    """Paths of the files that git knows or would take and that are there, sorted."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=root, capture_output=True, check=True).stdout
    names = sorted(set(listed.decode().split("\0")) - {""})
    return [name for name in names if (root / name).is_symlink() or (root / name).is_file()]


def module_name(path: str) -> str:
    """Dotted name of the module in a source, from the root of the checkout."""
    parts = Path(path).with_suffix("").parts[1:]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def end_group(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it has started and left in its group."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()
