"""Files that a change touches, counted in the source."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
CORE = ("shared", "client/cohaptic_client", "server/cohaptic_server")
PRODUCTION = ("shared", "client", "server", "web/src")
# A name of one law, as a member of `Law` or as a text. Whoever passes a law on names none.
_ONE = r"(\bLaw\.(PREDICTIVE|PROPORTIONAL|PI)\b|[\"'](proportional|predictive|pi)[\"'])"
_LAW = re.compile(_ONE)
_BRANCH = re.compile(rf"(\bis|\bis not|[!=]==?) (_(PREDICTIVE|PROPORTIONAL|PI)\b|{_ONE})")
_BODIES = "cohaptic_server.bodies"


def sources(folders: Iterable[str], suffixes: tuple[str, ...] = (".py", ".ts")) -> list[Path]:
    """Files of our own below some folders of the checkout, sorted."""
    found = (path for folder in folders for path in (ROOT / folder).rglob("*"))
    return sorted(
        path for path in found if path.suffix in suffixes and "node_modules" not in path.parts
    )


def naming(pattern: re.Pattern[str], folders: Iterable[str] = PRODUCTION) -> dict[Path, int]:
    """Files with lines in which a pattern is found, and how many lines."""
    counts = {
        path: sum(bool(pattern.search(line)) for line in path.read_text("utf-8").splitlines())
        for path in sources(folders)
    }
    return {path: count for path, count in counts.items() if count}


def of_a_law() -> dict[Path, int]:
    """Files that name a law; a new one is looked for in each."""
    return naming(_LAW)


def law_branches() -> dict[Path, int]:
    """Files with lines that ask which law it is."""
    return naming(_BRANCH)


def of_an_option(name: str) -> dict[Path, int]:
    """Files that name an option of an object, such as `simplify`."""
    return naming(re.compile(rf"\b{name}\b|--{name.replace('_', '-')}\b"))


def asked_for_bodies() -> dict[Path, int]:
    """Files outside the bodies that ask for a concrete body's class, by `isinstance`."""
    counts = {
        path: sum(1 for _ in _isinstances(ast.parse(path.read_text("utf-8"))))
        for path in sources(("server", "client", "experiments"), (".py",))
        if "bodies" not in path.parts
    }
    return {path: count for path, count in counts.items() if count}


def _isinstances(tree: ast.Module) -> Iterator[ast.Call]:
    bodies = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(_BODIES)
        for alias in node.names
        if not _is_ability(str(node.module), alias.name)
    }
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == "isinstance"
            and {n.id for n in ast.walk(node.args[1]) if isinstance(n, ast.Name)} & bodies
        ):
            yield node


def _is_ability(module: str, name: str) -> bool:
    """Whether a name of a module is that of a Protocol."""
    path = (ROOT / "server" / module.replace(".", "/")).with_suffix(".py")
    return path.is_file() and any(
        isinstance(node, ast.ClassDef)
        and node.name == name
        and any(isinstance(base, ast.Name) and base.id == "Protocol" for base in node.bases)
        for node in ast.parse(path.read_text("utf-8")).body
    )


def modules(folders: Iterable[str] = CORE) -> dict[Path, int]:
    """Python modules that say more than a docstring, and their lines."""
    texts = {path: path.read_text("utf-8") for path in sources(folders, (".py",))}
    return {path: len(text.splitlines()) for path, text in texts.items() if _says_more(text)}


def python_lines(*, of_tests: bool) -> int:
    """Lines of all Python that git keeps: of the tests, or of everything else with its tools."""
    listed = subprocess.run(["git", "ls-files", "*.py"], cwd=ROOT, capture_output=True, check=True)
    names = listed.stdout.decode().split()
    chosen = [name for name in names if name.startswith("tests/") == of_tests]
    return sum(len((ROOT / name).read_text("utf-8").splitlines()) for name in chosen)


def _says_more(text: str) -> bool:
    body = ast.parse(text).body
    return len(body) > 1 or (bool(body) and not isinstance(body[0], ast.Expr))


def comment_share(folders: Iterable[str] = CORE) -> float:
    """Lines that are a comment or end with one, over all."""
    lines = [line for path in modules(folders) for line in path.read_text("utf-8").splitlines()]
    return sum(bool(re.search(r"(^|\s)# ", line)) for line in lines) / len(lines)
