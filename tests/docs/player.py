"""Plays the blocks of one page, one after another, as somebody who copies them into a terminal.

What a page says is changed as little as a test must: servers take any free port of loopback, and
hands leave after some seconds.
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import re
import shlex
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import trimesh

from cohaptic.clock import SystemClock
from tests.docs.blocks import ROOT, Block, why_not
from tests.patience import PATIENCE, SCALE
from tests.recorded_sessions import record
from tests.server.credentials.pairs import write_pair

TOUCH = math.ceil(5.0 * max(1.0, SCALE))  # s that a hand is there, its start included
DEMO = 10  # s that a demo needs for its verdict
# What stands in a page for what its reader has.
_PLACES = {
    "YOUR_FILE": "examples/organ.ply",
    "URL": "ws://127.0.0.1:8765",
    "HOST": "127.0.0.1",
    "NAME": "simulated",
    "FOLDER": "kept",
    "0.0.0.0": "127.0.0.1",
}
_TOUCHED = re.compile(r"touched for \d+ of \d+ s, at most")  # the summary of a visit
_LISTENING = re.compile(r"^listening wss?://[^:]+:(\d+)", re.M)
CLOCK = SystemClock()
_ADMIN = re.compile(r"admin port http://127\.0\.0\.1:(\d+)")


class Player:
    """A terminal in a folder of its own, with what a reader has there.

    Args:
        folder: Empty.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, Any] = {}
        self._printed = ""
        self._server: subprocess.Popen[str] | None = None
        self._ports = {"8765": "0", "9100": "0"}
        (folder / "examples").symlink_to(ROOT / "examples")
        liver: Any = trimesh.Scene()
        shapes: Any = trimesh.creation
        for part, radius in (("liver", 0.05), ("tumour", 0.015)):
            liver.add_geometry(shapes.icosphere(2, radius), part, part)
        liver.export(folder / "liver.glb")
        write_pair(folder)

    def __enter__(self) -> Player:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is not None and self._server is not None:
            self._server.kill()  # what has failed is told, and not what it left behind
            self._server.communicate()
            return
        self._stop()

    def play(self, block: Block) -> int:
        """Play it, and return how many of its commands were run, or 1 for a program.

        Raises:
            AssertionError: A command did not end well.
        """
        if block.kind == "toml":
            name = re.match(r"# (\S+)\n", block.text)
            assert name is not None, f"{block.page}: the first line of a file names it"
            (self._folder / name[1]).write_text(self._placed(block.text), encoding="utf-8")
            return 1
        if block.kind == "python":
            return self._python(block)
        if block.kind == "text":  # what the program above it prints
            assert block.text == self._printed, self._printed
            return 1
        played = [command for command in block.commands if not why_not(command)]
        for command in played:
            self._command(command)
        return len(played)

    def _python(self, block: Block) -> int:
        before = Path.cwd()
        os.chdir(self._folder)
        try:
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                exec(compile(block.text, block.page, "exec"), self._names)
            self._printed = printed.getvalue()
        finally:
            os.chdir(before)
        return 1

    def _placed(self, text: str) -> str:
        for said, is_here in {**_PLACES, **self._ports}.items():
            text = re.sub(rf"(?<![\w.]){re.escape(said)}(?!\w)", is_here, text)
        return text

    def _command(self, command: str) -> None:
        words = shlex.split(command, comments=True)
        program, order = Path(words[0]).name, words[1:2]
        if order == ["serve"]:
            self._stop()
            words += [] if "--config" in words else ["--port", "8765"]
        if order == ["touch"]:
            words += ["--duration", str(TOUCH)]
            words += [] if any("://" in word for word in words) or "URL" in words else ["URL"]
            self._serve_if_none()
        if order == ["top"]:
            words += ["http://127.0.0.1:9100", "--once"]
        if order == ["demo"]:
            words += ["--no-browser", "--duration", str(DEMO)]
        if order in (["replay"], ["export"]):
            self._record_if_none(words[2])
        words = [self._placed(word) for word in words[1:]]
        if program == "cohaptic":
            words = [sys.executable, "-m", "cohaptic", *words]
        elif program.startswith("python"):
            words = [sys.executable, *words]
        else:
            words = [program, *words]
        if order == ["serve"]:
            self._serve(words)
            return
        if order == ["replay"]:
            self._replay([*words, "--no-browser"])
            return
        done = self._run(words)
        if order == ["touch"] and done.returncode == 0 and not _TOUCHED.search(done.stdout):
            # A busy machine needs more than these seconds until a hand is at the surface.
            again = ["--overwrite"] if "--record" in words else []
            done = self._run([*words, "--duration", str(6 * TOUCH), *again])
        # The doctor's status is its verdict on this machine.
        well = (0, 1) if order == ["doctor"] else (0,)
        assert done.returncode in well, f"{command}\n{done.stdout[-2000:]}"
        if order == ["touch"]:  # a visit that was meant to end ends so, and leaves a summary
            assert "trying again" not in done.stdout
            assert _TOUCHED.search(done.stdout), done.stdout

    def _run(self, words: list[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            words, cwd=self._folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, timeout=10 * PATIENCE, check=False,
        )  # fmt: skip

    def _record_if_none(self, name: str) -> None:
        """Pages that tell of a session take its file for granted."""
        if not (self._folder / name).exists():
            record(self._folder / name, 2.0)

    def _replay(self, words: list[str]) -> None:
        """Until its page is there."""
        process = subprocess.Popen(
            [*words, "--lifeline"], cwd=self._folder, text=True, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert process.stdout is not None
        lines = list[str]()
        while not lines or not lines[-1].startswith("page http://"):
            lines.append(process.stdout.readline())
            assert lines[-1], "".join(lines)
        with urllib.request.urlopen(lines[-1].split()[1], timeout=PATIENCE) as page:
            assert page.status == 200
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)
        assert process.returncode == 0

    def _serve_if_none(self) -> None:
        """Pages that tell of clients take a server for granted."""
        if self._server is None:
            self._command("cohaptic serve")

    def _serve(self, words: list[str]) -> None:
        """Until the next server of the page, or its end."""
        log = self._folder / "server.log"
        with log.open("w") as output:
            self._server = subprocess.Popen(
                [*words, "--lifeline"], cwd=self._folder, text=True, stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=output,
            )  # fmt: skip
        assert self._server.stdout is not None
        line = self._server.stdout.readline()
        found = _LISTENING.search(line)
        assert found is not None, f"{shlex.join(words)}\n{line}{log.read_text()}"
        self._ports["8765"] = found[1]
        if "--admin" in words:  # which begins once the server listens
            deadline = CLOCK.now() + PATIENCE
            while (admin := _ADMIN.search(log.read_text())) is None:
                assert CLOCK.now() < deadline, log.read_text()
                CLOCK.sleep_until(CLOCK.now() + 0.05)
            self._ports["9100"] = admin[1]

    def _stop(self) -> None:
        if self._server is None:
            return
        self._server.send_signal(signal.SIGINT)
        try:
            self._server.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self._server.kill()
            raise
        assert self._server.returncode == 0, (self._folder / "server.log").read_text()
        self._server = None
        self._ports = {"8765": "0", "9100": "0"}
