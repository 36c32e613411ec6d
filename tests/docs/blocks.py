"""The blocks of README, docs and examples: what they hold, and which of their lines are played."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

ROOT = Path(__file__).parents[2]
EVERY_PAGE = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
# Decisions are about their day, and the page of the architecture is drawn.
PAGES = [page for page in EVERY_PAGE if page.name != "architecture.md"]
_BLOCK = re.compile(
    r"^(?P<indent> *)(?P<fence>```+)(?P<kind>[^\n]*)\n(?P<text>.*?)^(?P=indent)(?P=fence)\s*$",
    re.S | re.M,
)
_INCLUDED = re.compile(r'--8<-- "([^"]+)"')
# Words that begin a command; a block without any is a drawing or a grammar.
_PROGRAMS = (
    "cohaptic|jupyter|python|python3|pip|curl|make|ssh|docker|sudo|install|systemctl|journalctl|npm|"
    r"\.venv/bin/\w+|/\S+/bin/\w+|\."
)
_COMMAND = re.compile(rf"(?:[A-Z_]+=\S+ )*(?:{_PROGRAMS})(?: .*)?")

# Lines that no test plays here, and why.
NOT_PLAYED = {
    r"make\b": "make: the target is the check",
    r"(?:\S*/bin/)?pip |python3 -m venv|\. \.venv": "installs: as `make` does it",
    r"(?:sudo|docker|systemctl|install|journalctl|ssh)\b": "of another machine or its owner",
    r'cohaptic touch "https://lab\.example': "of another machine or its owner",
    r"cohaptic serve .*--cluster": "needs several machines: tests/system/test_cluster.py",
    r"cohaptic devices (?:pulse|calibrate)|.*--device NAME": "needs hardware",
    r"cohaptic (?:touch --rule|why hunt\.npz)": "of a package: tests/examples/test_plugin.py",
    r"python -m (?:pip|build|zipfile|venv)|/tmp/try/": "of a release: .github/workflows/wheels.yml",
    r"python examples/step_|jupyter lab": "tests/examples/test_steps.py",
    r"cohaptic mark": "needs somebody who touches: tests/client/test_marking.py",
    r"cohaptic admin .*record": "needs a token: tests/client/test_admin.py",
    r"cohaptic replay .*--verify": "needs a session: tests/system/test_session_processes.py",
    r"python benchmarks/many_objects\.py": "hours: a part of `make night`",
}
# Kinds of blocks that nothing here can play, and the tests that try what they show.
OTHER_KINDS = {
    "nginx": "tests/system/test_deploy.py",
    "html": "tests/browser/test_frames.py",
    "cpp": "tests/clients_cpp/test_cpp_client.py",
    "step": "tests/examples/test_steps.py",
    "py": "tests/client/scripting/test_recording.py",
}


@dataclass(frozen=True, slots=True)
class Block:
    """What stands between two fences.

    Args:
        page: Path below the root.
        kind: The word after the fence, such as python; empty for none; "step" for one of a course.
        text: With what it includes.
    """

    page: str
    kind: str
    text: str

    @property
    def commands(self) -> list[str]:
        """Lines for a shell, comments and all; empty where it is none."""
        return [part for line in self._lines for part in line if _COMMAND.fullmatch(part)]

    @property
    def other_lines(self) -> list[str]:
        """Lines of a block of commands that are none, nor comments."""
        first = [line[0] for line in self._lines] if self.commands else []
        return [
            line for line in first if line[:1] not in ("", "#") and not _COMMAND.fullmatch(line)
        ]

    @property
    def _lines(self) -> list[list[str]]:
        """What is typed, each line in its parts between `&&`; empty where it is no shell's."""
        if self.kind not in ("", "sh"):
            return []
        lines = self.text.replace("\\\n", " ").splitlines()
        return [[part.strip() for part in re.split(r"\s&&\s", line)] for line in lines]


def blocks() -> Iterator[Block]:
    """All of them, in the order of pages and lines."""
    for page in PAGES:
        for found in _BLOCK.finditer(page.read_text(encoding="utf-8")):
            text, kind = dedent(found["text"]), found["kind"].strip("{.} ")
            if "examples/step_" in text and _INCLUDED.search(text):
                kind = "step"
            text = _INCLUDED.sub(lambda mark: (ROOT / mark[1]).read_text("utf-8"), text)
            yield Block(page.relative_to(ROOT).as_posix(), kind, text)


def why_not(command: str) -> str:
    """Why a command is not played; empty for one that is."""
    plain = re.sub(r"^(?:[A-Z_]+=\S+ )+", "", command)
    return next((why for rule, why in NOT_PLAYED.items() if re.match(rule, plain)), "")
