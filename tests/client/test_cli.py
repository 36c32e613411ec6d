from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic_client.devices.catalogue import names

pytestmark = pytest.mark.live


@pytest.fixture(autouse=True)
def _keep_signals() -> Iterator[None]:  # pyright: ignore[reportUnusedFunction]  # pytest uses it
    """A command takes Ctrl-C and kill over for its process."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def nobody() -> Iterator[str]:
    """An address where nobody listens."""
    with socket.socket() as reserved:
        reserved.bind(("127.0.0.1", 0))
        yield f"ws://127.0.0.1:{reserved.getsockname()[1]}"


def complaint(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The sentence with which `cohaptic touch` ends."""
    with pytest.raises(SystemExit) as ended:
        main(["touch", *arguments])
    assert ended.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err.removeprefix("cohaptic: ").removesuffix("\n")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--loop-hz", "10"], "loop rate is 10.0 Hz; it must be from 500 to 4000 Hz"),
        (["--loop-hz", "nan"], "loop rate is nan Hz; it must be from 500 to 4000 Hz"),
        (["--loop-hz", "-1000"], "loop rate is -1000.0 Hz; it must be from 500 to 4000 Hz"),
        (["--delay-ms", "-1"], "delay of a link is -0.001 s; it must be from 0 to 5 s"),
        (["--delay-up-ms", "nan"], "delay of a link is nan s; it must be from 0 to 5 s"),
        (["--jitter-ms", "9999"], "jitter of a link is 9.999 s; it must be from 0 to 5 s"),
        (["--jitter-down-ms", "-1"], "jitter of a link is -0.001 s; it must be from 0 to 5 s"),
        (["--depth-mm", "999"], "depth of a hand is 999 mm; it must be from 0 to 200 mm"),
        (["--angle", "inf"], "angle of a hand is inf rad; it must be from -2 pi to 2 pi rad"),
        (
            ["--at", "0.1", "-0.2", "0"],
            "--at is (0.1, -0.2, 0.0); it must be given together with --inward",
        ),
        (
            ["--at", "0", "0", "0", "--inward", "0", "0", "-2"],
            "length of the way in is 2; it must be 1",
        ),
        (["--rhythm-s", "0.01"], "rhythm is 0.01 s; it must be from 0.1 to 3600 s"),
        (["--max-force", "0"], "max force is 0.0 N; it must be above 0, at most 100 N"),
        (["--duration", "0"], "duration is 0.0 s; it must be above 0"),
        (["--wait", "nan"], "wait is nan s; it must be 0 or more"),
        (["--name", ""], "name is ''; it must be 1 to 32 printable characters"),
        (
            ["--device", "nonsense"],
            f"device is 'nonsense'; it must be one of: {', '.join(names())}",
        ),
        (
            ["--record", "/nowhere/x.npz"],
            "--record is /nowhere/x.npz; it must be a file that ends with .npz in a folder that"
            " exists: not /nowhere",
        ),
        (["--record", "eva.csv"], "--record is eva.csv; it must be a file that ends with .npz"),
        (["--record", "eva"], "--record is eva; it must be a file that ends with .npz"),
    ],
)
def test_a_bad_value_is_one_sentence_before_anything_is_tried(
    capsys: pytest.CaptureFixture[str], arguments: list[str], sentence: str
) -> None:
    assert complaint(capsys, *arguments) == sentence


def test_a_recording_is_a_new_plain_file(
    capsys: pytest.CaptureFixture[str], nobody: str, tmp_path: Path
) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(b"an earlier one")
    refused = complaint(capsys, nobody, "--wait", "0", "--record", str(path))
    assert "and this one exists: choose another name, or replace it by --overwrite" in refused
    assert path.read_bytes() == b"an earlier one"
    (tmp_path / "left.npz.part").write_bytes(b"rows")
    refused = complaint(capsys, nobody, "--wait", "0", "--record", str(tmp_path / "left.npz"))
    assert "cohaptic recording --finish" in refused
    os.mkfifo(tmp_path / "pipe.npz")
    refused = complaint(capsys, nobody, "--record", str(tmp_path / "pipe.npz"), "--overwrite")
    assert refused.endswith("a file, and it is a device or a pipe")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--law", "magic"], "magic"),
        (["--geometry", "cube"], "cube"),
        (["--delay-ms", "many"], "--delay-ms"),
        (["--nonsense"], "--nonsense"),
        (["a", "b"], "extra argument"),
    ],
)
def test_what_is_no_value_at_all_is_named(
    capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["touch", *arguments])
    assert ended.value.code == 2
    err = capsys.readouterr().err
    assert words in err
    assert "Traceback" not in err


def test_a_server_is_waited_for_without_being_asked_to(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["touch", "--help"])
    words = " ".join(capsys.readouterr().out.replace("\u2502", " ").split())
    assert re.search(
        r"--wait <float> How long to try [^\]]*\] *\. *\[default: 5 at first", words
    ), words


def test_the_process_says_the_same_and_ends_with_two(nobody: str) -> None:
    command = [sys.executable, "-m", "cohaptic", "touch", nobody, "--wait", "0"]
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 2
    assert done.stdout == ""
    said = f"cohaptic: {nobody}: no server answers; start one with: cohaptic serve\n"
    assert done.stderr == said
