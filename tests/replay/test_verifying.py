"""`cohaptic replay --verify`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from cohaptic.cli.app import main
from cohaptic.sessions.entries import Heard, SessionInfo, Written
from cohaptic.sessions.reader import read_entries
from cohaptic.sessions.writer import SessionFile
from cohaptic.simulated.hand import HandScript
from cohaptic_experiments import VirtualSession
from cohaptic_server import Verdict, verify_session
from cohaptic_server.bodies.body import Body
from cohaptic_server.cli.object_options import ObjectOptions, made_from_options
from cohaptic_server.objects.catalogue import build_body
from cohaptic_tools.verifying import in_words, logged
from tests.still_clock import StillClock

BALLOON = made_from_options("balloon", ObjectOptions(), None, 0.0, nonlinear=False)


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[object, str]:
    with pytest.raises(SystemExit) as ended:
        main(["replay", "--verify", *words])
    out, err = capsys.readouterr()
    return ended.value.code, out + err


def pressed(path: Path, body: Body | None = None) -> Path:
    session = VirtualSession(build_body("balloon") if body is None else body)
    with session.record(path):
        session.join("ann", HandScript())
        session.join("bob", HandScript(angle=1.5))
        session.run(1.5)
    return path


def written(path: Path, entries: list[Written]) -> Path:
    """A file with these entries."""
    info, *rest = entries
    assert isinstance(info, SessionInfo)
    file = SessionFile("--record", path, info, plots=False)
    for entry in rest:
        file.add(entry)
    file.close()
    return path


def entries_of(path: Path, **made_from: object) -> list[Written]:
    """The entries of a file, with other words on how its object was made."""
    info, *rest = read_entries(path)
    assert isinstance(info, SessionInfo)
    kept: list[Written] = [entry for entry in rest if isinstance(entry, Written)]
    settings = {**info.settings, **made_from}
    return [replace(info, settings=settings), *kept]


@pytest.fixture(scope="module")
def balloon(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("verified")
    return written(folder / "b.mcap", entries_of(pressed(folder / "a.mcap"), **BALLOON))


def test_a_session_agrees_with_what_its_room_heard(
    balloon: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, words = run(capsys, str(balloon))
    assert code == 0
    assert words.startswith("all 1")
    assert "patches are the same to the last bit" in words
    assert verify_session(balloon, build_body("balloon")).holds


def test_one_that_lacks_a_sample_does_not(
    balloon: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    entries = entries_of(balloon)
    heard = [entry for entry in entries if isinstance(entry, Heard)]
    less = [entry for entry in entries if entry is not heard[-30]]
    code, words = run(capsys, str(written(tmp_path / "less.mcap", less)))
    assert code == 1
    assert "the largest difference is" in words


@pytest.mark.parametrize(
    ("made_from", "said"),
    [
        ({"body": "liver.stl"}, "--body is not given; it must be given as the object's file"),
        ({"body": None, "class": "lab:Ring"}, "a program made its object (lab:Ring)"),
        ({"relaxation": "long"}, "does not say how its object was made"),
        ({"from_rest": False}, "it began after people had touched the object"),
    ],
)
def test_what_cannot_be_made_again_is_an_error(
    made_from: dict[str, object],
    said: str,
    balloon: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = written(tmp_path / "x.mcap", entries_of(balloon, **made_from))
    code, words = run(capsys, str(file))
    assert code == 2
    assert said in words.replace("\n", " ")


def test_a_long_comparison_logs_how_far_it_is_and_a_short_one_does_not(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level("INFO")
    clock = StillClock()
    log = logged(clock, "verifying x.mcap")
    for _ in range(15):
        clock.t += 0.125
        log((clock.t - 100.0) / 64.0)
    assert caplog.messages == []
    while clock.t < 164.0:
        clock.t += 0.125
        log((clock.t - 100.0) / 64.0)
    assert caplog.messages == [
        f"verifying x.mcap: {said} left"
        for said in (
            "3 % 1:02", "19 % 0:52", "34 % 0:42", "50 % 0:32", "66 % 0:22", "81 % 0:12",
            "97 % 0:02",
        )
    ]  # fmt: skip


def test_a_folder_with_one_session_is_verified(
    balloon: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.mcap").write_bytes(balloon.read_bytes())
    code, words = run(capsys, str(tmp_path))
    assert code == 0
    assert f"the session is {tmp_path / 'x.mcap'}" in words


def test_a_verdict_in_words() -> None:
    assert in_words(Verdict()) == "there is no patch in the session"
    assert "2 patches are in the file alone, or not in it" in in_words(Verdict(3, 3, missing=2))
    assert "1e-07 (k_h)" in in_words(Verdict(3, 1, 1e-7, "k_h"))
