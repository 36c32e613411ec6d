"""Recordings of a scene in which everything goes as it should, made from its truth."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from cohaptic.recording.archive import write_archive
from cohaptic.recording.journal import Clocks, Header
from cohaptic.recording.outline import Outline
from cohaptic.recording.recorder import Recorder
from cohaptic.simulated.hand import HandState, move
from cohaptic.status.row import COLUMNS
from cohaptic.vec import ZERO, Vec3
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.at_once import Mover, play_at_once
from cohaptic_tools.demo.analysis import STEP, Recording
from cohaptic_tools.demo.comparison import RIGHT, reference_drag
from cohaptic_tools.demo.scene import Scene

LAG = 0.16  # s, of the room while the first hand presses


def blank(name: str, t: Floats) -> Recording:
    """A hand that is engaged, in place, and feels nothing."""
    columns: dict[str, Floats] = {column: np.zeros_like(t) for column in COLUMNS}
    columns |= {"t": t.copy(), "scale": np.ones_like(t), "level": np.ones_like(t)}
    columns["tick"] = 1.0 + np.floor(60.0 * (t - t[0])) if t.size else t.copy()
    return Recording(name, columns)


def levels(scene: Scene, body: Body, t: Floats) -> Floats:
    """What everybody intends, shape (users, n)."""
    info = describe(body)
    intentions = [scene.script(u).intention(info.center, info.radius) for u in range(scene.users)]
    return np.array([[i.level(at) for at in t] for i in intentions])


def played(scene: Scene, body: Body, *, seconds: float, delay: float) -> list[Recording]:
    """A scene played without a network, of which the others' part is recorded `delay` later [s]."""
    t = np.arange(0.0, seconds, STEP)
    level = levels(scene, body, t)
    motion = play_at_once(body, [_hand(scene, body, u) for u in range(scene.users)], seconds)
    found: list[Recording] = []
    for user, name in enumerate(scene.names):
        recording, tips = blank(name, t), motion.tips[user]
        out = tips / np.linalg.norm(tips, axis=0)
        recording.columns.update(zip(("x", "y", "z"), tips, strict=True))
        forces = motion.force[user] * out
        recording.columns.update(zip(("fx", "fy", "fz"), forces, strict=True))
        felt = np.asarray(np.interp(t - delay, t, motion.from_others[user]), dtype=np.float64)
        recording.columns.update(felt_from_others=felt, level=level[user])
        recording.columns["k_h"] += 200.0
        recording.columns["lag"] += LAG * (level[0] >= 1.0)  # nobody else is there without it
        found.append(recording)
    return found


def _hand(scene: Scene, body: Body, user: int) -> Mover:
    """A hand of the scene, in the air at first."""
    info, script = describe(body), scene.script(user)
    intention = script.intention(info.center, info.radius)
    state = HandState(intention.position(0.0), ZERO)

    def mover(now: float, force: Vec3) -> Vec3:
        nonlocal state
        state = move(state, script.hand, intention.position(now), force, STEP)
        return state.position

    return mover


def dragged(scene: Scene, body: Body, *, seconds: float, delay: float) -> list[Recording]:
    """A scene in which the first hand drags, and the second is dragged `delay` later [s]."""
    t = np.arange(0.0, seconds, STEP)
    level, true, info = levels(scene, body, t), reference_drag(scene, body), describe(body)
    late = np.asarray(np.interp(t - delay, t, level[0]), dtype=np.float64)
    found: list[Recording] = []
    for user, name in enumerate(scene.names):
        script, recording = scene.script(user), blank(name, t)
        intention = script.intention(info.center, info.radius)
        fraction: Floats = late if user == RIGHT else level[0]
        off, on = true.rest.force[user], true.dragged.force[user]
        force: Floats = off[:, None] + (on - off)[:, None] * fraction
        wanted = np.array([intention.tip(at) for at in level[user]]).T
        recording.columns.update(zip(("fx", "fy", "fz"), force, strict=True))
        tip = wanted + force / script.hand.stiffness
        recording.columns.update(zip(("x", "y", "z"), tip, strict=True))
        recording.columns["level"] = level[user]
        found.append(recording)
    return found


def save(recording: Recording, folder: Path, to_wall: float = 0.0) -> Path:
    """Write a recording as a client does; one without a row, too, which a client does not."""
    path = folder / f"{recording.name}.npz"
    if not recording.columns["t"].size:
        outline = Outline(
            Header(recording.name, COLUMNS, 1.0 / STEP), clocks=[Clocks(0.0, to_wall)]
        )
        with path.open("wb") as file:
            write_archive(io.BytesIO(), outline, file)
        return path
    recorder = Recorder(
        path, name=recording.name, loop_hz=1.0 / STEP, overwrite=True, tell=lambda words: None
    )
    table = np.array([recording.columns[column] for column in COLUMNS]).T
    recorder.keep(table.astype("<f8").tobytes())
    recorder.note(Clocks(0.0, to_wall))
    recorder.finish()
    return path
