"""Which tests reach which line: recorded once, in one file.

The file is coverage's own database with two tables more. A line that runs at import runs in no
test: its tests are those that reach any line of its module or of a module that imports it, and
those of the files of tests that import it. What a fixture ran is put down to all tests of the file.
Results that tests share by a cache are put down to the first of them alone.
"""

from __future__ import annotations

import ast
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from functools import cache
from hashlib import sha256
from pathlib import Path

from coverage import CoverageData

from mutant_checkout import SIDES, Checkout, Session, known_files, module_name
from mutant_making import Mutant
from mutant_plugin import SETUP, TEST

# The other cores of coverage cannot tell one test from the next. Processes that are ended by
# SIGTERM write what they have run before they end.
SETTINGS = """[run]
core = ctrace
parallel = true
sigterm = true
data_file = {folder}/lines
context = ${{{test}-}}
source = {sources}
"""
TABLES = """
create table if not exists test (name text primary key, seconds real, passed integer);
create table if not exists source (path text primary key, digest text);
"""


def record(checkout: Checkout, folder: Path, arguments: list[str], db: Path) -> Session:
    """Run tests under coverage, and add to the database what they reach.

    Args:
        checkout: Without a fault.
        folder: An empty one, for the raw data.
        arguments: Arguments of pytest, with the tests to run.
        db: May be there, from other tests of the same sources.
    """
    settings = folder / "coverage.ini"
    sources = ",".join(str(checkout.root / side) for side in SIDES)
    text = SETTINGS.format(folder=folder, test=TEST, sources=sources)
    settings.write_text(text, encoding="utf-8")
    session = checkout.pytest(arguments, {"COVERAGE_PROCESS_START": str(settings)})
    data = CoverageData(str(db))
    data.read()
    for path in sorted(folder.glob("lines.*")):
        part = CoverageData(str(path))
        part.read()
        data.update(part, map_path=lambda name: Path(name).relative_to(checkout.root).as_posix())
    files = sorted(data.measured_files())
    data.close()
    with closing(sqlite3.connect(db)) as rows, rows:
        rows.executescript(TABLES)
        tests = [(name, s, how == "passed") for name, (s, how) in session.tests.items()]
        rows.executemany("insert or replace into test values (?, ?, ?)", tests)
        digests = [(name, digest(checkout.root / name)) for name in files]
        rows.executemany("insert or replace into source values (?, ?)", digests)
    return session


def digest(path: Path) -> str:
    """Digest of a file's bytes."""
    return sha256(path.read_bytes()).hexdigest()


class Reach:
    """What was recorded."""

    def __init__(self, db: Path, root: Path) -> None:
        """Read a database.

        Args:
            db: Written by `record`.
            root: Root of the checkout.

        Raises:
            ValueError: It is none, or sources have changed since.
        """
        self._root = root
        self._data = CoverageData(str(db))
        self._data.read()
        self._files = sorted(self._data.measured_files())
        with closing(sqlite3.connect(db)) as rows:
            rows.executescript(TABLES)
            tests = rows.execute("select name, seconds from test where passed").fetchall()
            sources = rows.execute("select path, digest from source").fetchall()
        self.seconds: dict[str, float] = dict(tests)
        changed = [p for p, was in sources if not (root / p).is_file() or digest(root / p) != was]
        if not tests or changed:
            why = f"{', '.join(changed[:3])} have changed since" if changed else "no test passed"
            raise ValueError(f"{db}: {why}; delete it and record anew")
        self._importers = cache(self._find_importers)
        self._lines = cache(self._read_lines)

    def tests(self, mutant: Mutant) -> list[str]:
        """Tests that reach a mutant, file by file: of its own module first, short ones next."""
        if mutant.at_import:
            found = set[str]()
            for path in (mutant.path, *self._importers(mutant.path)):
                if path in self._files:
                    found.update(*self._lines(path).values())
                else:
                    found.update(name for name in self.seconds if name.startswith(f"{path}::"))
        else:
            lines, (first, last) = self._lines(mutant.path), mutant.lines
            found = set[str]().union(*(lines.get(n, ()) for n in range(first, last + 1)))
        own = f"/test_{Path(mutant.path).name}::"
        cost = dict.fromkeys((name.partition("::")[0] for name in found), 0.0)
        for name in found:
            cost[name.partition("::")[0]] += self.seconds[name]

        def nearest(name: str) -> tuple[bool, float, str, str]:
            file = name.partition("::")[0]
            return own not in name, cost[file], file, name

        return sorted(found, key=nearest)

    def _read_lines(self, path: str) -> dict[int, set[str]]:
        """Tests of each line of a source; only those that passed."""
        if path not in self._files:
            return {}
        return {
            line: {test for context in contexts for test in self._tests_of(context)}
            for line, contexts in self._data.contexts_by_lineno(path).items()
        }

    def _tests_of(self, context: str) -> Iterator[str]:
        if context.endswith(SETUP):
            file = context.partition("::")[0]
            yield from (name for name in self.seconds if name.startswith(f"{file}::"))
        elif context in self.seconds:
            yield context

    def _find_importers(self, path: str) -> list[str]:
        """Sources and files of tests that import a source, but for packages that pass names on."""
        module = module_name(path)
        tests = {name.partition("::")[0] for name in self.seconds}
        return [
            name
            for name in known_files(self._root)
            if name in tests.union(self._files) and module in imported(self._root / name)
        ]


@cache
def imported(path: Path) -> frozenset[str]:
    """Dotted names that a source imports: modules, and names in them."""
    found = set[str]()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return frozenset(found)
