"""The patches of a recording, computed again from what the room heard."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from cohaptic.control.law import Law
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.scene import Scene
from cohaptic.protocol.traversal import Traversal
from cohaptic.sessions.entries import (
    Damage,
    Entry,
    Heard,
    LeftOut,
    Patched,
    SessionInfo,
    Shown,
    Ticked,
)
from cohaptic.sessions.reader import read_entries
from cohaptic.simulated.hand import HandScript
from cohaptic.vec import norm, scale
from cohaptic_experiments import VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.bodies.body import Body
from cohaptic_server.objects.catalogue import build_body
from cohaptic_server.shell.verification import NotVerifiable, Verdict, verify
from tests.server.bodies.modal.jelly import jelly


def played(body: Body, path: Path) -> VirtualSession:
    """Two people press; one changes the law and leaves; an administrator has orders."""
    session = VirtualSession(body)
    with session.record(path):
        session.join("ann", HandScript(), delay=0.02, jitter=0.005, seed=1)
        session.run(0.3)
        session.join("bob", HandScript(angle=2.0), friction=0.3, geometry="sphere")
        session.run(0.5)
        session.set_law("ann", Law.PI)
        session.room.force_budget = 1.0
        session.run(0.3)
        session.room.members[session.users["bob"].number].muted = True
        session.run(0.2)
        session.room.frozen = True
        session.run(0.1)
        session.room.frozen = False
        session.drop("ann")
        session.run(0.3)
        session.room.reset(session.now)
        session.join("ann", HandScript(angle=1.0), models=True, tells_hand=True)
        session.run(0.5)
    return session


def judged(entries: Iterator[Entry] | list[Entry], body: Body) -> Verdict:
    verdict = Verdict()
    for _, so_far in verify(entries, body):
        verdict = so_far
    return verdict


BODIES: dict[str, Callable[[], Body]] = {
    "balloon": Balloon,
    "viscous balloon": lambda: build_body("balloon", damping=2.0),
    "rubber balloon": lambda: build_body("balloon", nonlinear=True),
    "spring": lambda: build_body("spring"),
    "swinging block": jelly,
}


@pytest.mark.parametrize("name", BODIES)
def test_every_patch_comes_out_as_it_was(name: str, tmp_path: Path) -> None:
    played(BODIES[name](), tmp_path / "x.mcap")
    verdict = judged(read_entries(tmp_path / "x.mcap"), BODIES[name]())
    assert verdict.holds
    assert verdict.patches > 150
    assert verdict.worst <= 1e-12


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> list[Entry]:
    path = tmp_path_factory.mktemp("recorded") / "x.mcap"
    played(Balloon(), path)
    return list(read_entries(path))


def test_the_scenes_of_a_recording_are_those_of_the_wire(recorded: list[Entry]) -> None:
    mesh = Balloon().mesh
    order = Traversal.of(len(mesh.vertices), mesh.faces)
    patched = {entry.tick for entry in recorded if isinstance(entry, Patched)}
    scenes = [Scene.decode(entry.frame, order) for entry in recorded if isinstance(entry, Shown)]
    ticks = [scene.tick for scene in scenes]
    assert ticks == sorted(set(ticks))
    assert patched <= set(ticks)
    assert {user.user for scene in scenes for user in scene.users} == {1, 2, 3}


def test_a_sample_that_was_changed_is_found(recorded: list[Entry]) -> None:
    heard = [entry for entry in recorded if isinstance(entry, Heard)]
    one = next(entry for entry in heard if norm(ContactSample.decode(entry.frame).force) > 0.1)
    sample = ContactSample.decode(one.frame)
    stronger = replace(one, frame=sample._replace(force=scale(sample.force, 1.001)).encode())
    changed = [stronger if entry is one else entry for entry in recorded]
    verdict = judged(changed, Balloon())
    assert not verdict.holds
    assert "at tick" in verdict.where


def test_another_body_is_found(recorded: list[Entry], small_balloon: Balloon) -> None:
    assert not judged(recorded, small_balloon).holds


def test_a_patch_that_nobody_computes_is_missing(recorded: list[Entry]) -> None:
    last = next(entry for entry in reversed(recorded) if isinstance(entry, Patched))
    assert judged([*recorded, replace(last, user=99)], Balloon()).missing == 1


def test_patches_that_the_file_lacks_are_missing(recorded: list[Entry]) -> None:
    patched = [entry for entry in recorded if isinstance(entry, Patched)]
    less = [entry for entry in recorded if entry not in patched[20:30]]
    verdict = judged(less, Balloon())
    assert (verdict.missing, verdict.holds) == (10, False)


def test_a_file_that_is_cut_short_says_so(recorded: list[Entry]) -> None:
    ticks = [i for i, entry in enumerate(recorded) if isinstance(entry, Ticked)]
    verdict = judged([*recorded[: ticks[60]], Damage(0.0, cut_short=True)], Balloon())
    assert verdict.cut_short
    assert verdict.holds


@pytest.mark.parametrize("what", ["late", "a gap", "left out", "no beginning"])
def test_what_cannot_be_computed_again_says_why(what: str, recorded: list[Entry]) -> None:
    info, *rest = recorded
    assert isinstance(info, SessionInfo)
    entries: list[Entry] = {
        "late": [replace(info, settings={**info.settings, "from_rest": False}), *rest],
        "a gap": [e for e in recorded if not (isinstance(e, Ticked) and e.tick == 40)],
        "left out": [info, LeftOut(info.t, 3), *rest],
        "no beginning": rest,
    }[what]
    with pytest.raises(NotVerifiable, match=r"cannot be computed again: ."):
        judged(entries, Balloon())


def test_a_room_at_rest_is_a_beginning_whoever_was_there_before(tmp_path: Path) -> None:
    session = VirtualSession(Balloon())
    session.join("early", HandScript())
    session.run(1.0)
    session.drop("early")
    session.run(3.0)
    assert session.room.at_rest
    with session.record(tmp_path / "x.mcap"):
        session.join("late", HandScript(angle=1.0))
        session.join("later", HandScript(angle=2.0))
        session.run(1.5)
    verdict = judged(read_entries(tmp_path / "x.mcap"), Balloon())
    assert verdict.holds
    assert verdict.identical == verdict.patches > 100


def test_an_empty_recording_proves_nothing(recorded: list[Entry]) -> None:
    assert not judged(recorded[:1], Balloon()).holds
