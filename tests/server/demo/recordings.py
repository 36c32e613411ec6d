"""Recordings of a scene in which everything goes as it should, made from its truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cohaptic.record import COLUMNS, Row
from cohaptic_client.recorder import Recorder
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.demo.analysis import STEP, Recording
from cohaptic_server.demo.scene import Scene, truth
from cohaptic_server.room import describe


def blank(name: str, t: Floats) -> Recording:
    """A hand that is engaged, in place, and feels nothing."""
    columns: dict[str, Floats] = {column: np.zeros_like(t) for column in COLUMNS}
    columns |= {"t": t.copy(), "scale": np.ones_like(t), "level": np.ones_like(t)}
    columns["tick"] = 1.0 + np.floor(60.0 * (t - t[0])) if t.size else t.copy()
    return Recording(name, columns)


def played(scene: Scene, body: Body, *, seconds: float, delay: float) -> list[Recording]:
    """A scene of which everybody feels the truth, the others' part of it `delay` later [s]."""
    t = np.arange(0.0, seconds, STEP)
    info = describe(body)
    pressed, released = truth(scene, body, pressed=True), truth(scene, body, pressed=False)
    intentions = [scene.script(u).intention(info.center, info.radius) for u in range(scene.users)]
    levels = np.array([[i.level(at) for at in t] for i in intentions])

    def between(off: Floats, on: Floats, late: float = 0.0) -> Floats:
        """From the one to the other as the first hand presses, shape (users, ..., n)."""
        share = np.asarray(np.interp(t - late, t, levels[0]), dtype=np.float64)
        return np.asarray(off[..., None] + (on - off)[..., None] * share)

    def lift(at_rest: Floats, compliance: Floats) -> Floats:
        """Displacement of each contact by the others, along its outward normal [m]."""
        return np.asarray(np.diag(compliance) * at_rest - compliance @ at_rest)

    tip = between(released.tip, pressed.tip)
    force = between(released.force, pressed.force)
    felt = between(released.felt_from_others, pressed.felt_from_others)
    lifted = between(
        lift(released.force, released.compliance), lift(pressed.force, pressed.compliance), delay
    )
    found: list[Recording] = []
    for user, name in enumerate(scene.names):
        recording = blank(name, t)
        out = tip[user] / np.linalg.norm(tip[user], axis=0)
        recording.columns.update(
            zip(("x", "y", "z", "fx", "fy", "fz"), [*tip[user], *(force[user] * out)], strict=True)
        )
        recording.columns.update(
            felt_from_others=felt[user], u_others=lifted[user], level=levels[user]
        )
        recording.columns["k_h"] += 200.0
        found.append(recording)
    return found


def save(recording: Recording, folder: Path, to_wall: float = 0.0) -> Path:
    """Write a recording as a client does."""
    path = folder / f"{recording.name}.npz"
    recorder = Recorder(1.0 / STEP)
    table = np.array([recording.columns[column] for column in COLUMNS]).T
    recorder.keep([Row(*row) for row in table.tolist()])
    recorder.save(path, name=recording.name, to_wall=to_wall)
    return path
