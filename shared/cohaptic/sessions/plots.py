"""What Foxglove draws, made of the entries while they are written: pure, with a little memory.

    /user/NUMBER/plot   cohaptic.Plot             60 per second: tip, force, what each rule did
    /hands              foxglove.SceneUpdate      30 per second: tips, and arrows of the forces
    /object             foxglove.SceneUpdate      once: the resting surface
    /tf                 foxglove.FrameTransform   once: without it Foxglove knows no frame
    /log                foxglove.Log              marks and events

All are JSON, after the schemas that Foxglove publishes. `docs/how-to/foxglove-layout.json` is a
layout for them. They repeat in a readable form what other channels have in full, so that our own
reader passes over them.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from cohaptic.errors import RemoteProtocolError
from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.scene_users import UserRecord, decode_users
from cohaptic.sessions.codec import table_of
from cohaptic.sessions.entries import (
    MAX_TIME,
    Happened,
    Joined,
    Left,
    Mark,
    Mesh,
    Rows,
    SessionInfo,
    Shown,
    Written,
    nanoseconds,
)
from cohaptic.sessions.foxglove import FRAME_TRANSFORM, LOG, SCENE_UPDATE
from cohaptic.sessions.schemas import Schema
from cohaptic.vec import Vec3, norm

PLOT_HZ = 60.0  # more than a screen shows
HANDS_HZ = 30.0  # a scene has 400 characters for each hand
FRAME = "room"
# A finer surface has several MB as JSON, which is more than a picture of it is worth.
MAX_VERTICES = 20_000
METRES_PER_NEWTON = 0.02  # length of an arrow: 10 N are as long as a hand is wide
_NOT_FINITE = re.compile(r"(?<=:)(-?inf|nan)(?=[,}])")
_DRAWABLE = 1e6  # m, N; JSON has no infinite numbers, and a picture no larger ones
_BLUNT = 1e-3  # N; a shorter arrow has no direction
_INFO, _WARNING = 2, 3  # levels of `foxglove.Log`

PLOT = Schema(
    "cohaptic.Plot",
    "jsonschema",
    json.dumps(
        {
            "type": "object",
            "description": "State of one hand in SI units: m, N. A number that is not finite is "
            "null. `rules` says what each rule did to the force; together they are its size.",
            "properties": {
                "t": {"type": "number", "description": "Time on the server's clock [s]"},
                "tip": {"$ref": "#/$defs/vector"},
                "force": {"$ref": "#/$defs/vector"},
                "newtons": {"type": ["number", "null"]},
                "rules": {"type": "object", "additionalProperties": {"type": ["number", "null"]}},
            },
            "required": ["t", "tip", "force", "newtons", "rules"],
            "$defs": {
                "vector": {
                    "type": "object",
                    "properties": {axis: {"type": ["number", "null"]} for axis in "xyz"},
                    "required": ["x", "y", "z"],
                }
            },
        },
        sort_keys=True,
    ).encode(),
)
# Of the eight colours of Okabe and Ito, which people of all kinds of sight tell apart.
_COLOURS = (
    (0.90, 0.62, 0.00), (0.34, 0.71, 0.91), (0.00, 0.62, 0.45), (0.94, 0.89, 0.26),
    (0.00, 0.45, 0.70), (0.84, 0.37, 0.00), (0.80, 0.47, 0.65), (0.50, 0.50, 0.50),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Drawn:
    """Message for a channel of Foxglove.

    Args:
        topic: Name of the channel.
        schema: Its description.
        t: Time on the server's clock [s].
        data: The message as JSON.
    """

    topic: str
    schema: Schema
    t: float
    data: bytes


class Plotter:
    """Makes the messages for Foxglove.

    Args:
        info: First entry of the session.
    """

    def __init__(self, info: SessionInfo) -> None:
        self._to_wall = info.to_wall
        self._names: dict[int, str] = {}
        self._plotted: dict[int, float] = {}  # number of the last plot's 60th of a second, by user
        self._scene = -math.inf

    def of(self, entry: Written) -> Sequence[Drawn]:
        """Return the messages that an entry gives; most give none."""
        match entry:
            case Rows():
                return self._plots(entry)
            case Shown():
                return self._hands(entry)
            case SessionInfo():
                return [self._frame(entry)]
            case Mesh():
                return self._object(entry)
            case Joined():
                self._names[entry.user] = entry.name
                return [self._log(entry.t, "joined", f"{entry.name} joined")]
            case Left():
                name = self._names.get(entry.user, f"user {entry.user}")
                return [self._log(entry.t, "left", f"{name}: {entry.reason}")]
            case Mark():
                return [self._log(entry.t, "mark", entry.text)]
            case Happened():
                return [self._log(entry.t, entry.kind, entry.text)]
            case _:
                return ()

    def _plots(self, rows: Rows) -> list[Drawn]:
        table, columns = table_of(rows), rows.columns
        if not len(table) or not {"x", "y", "z", "fx", "fy", "fz"} <= set(columns):
            return []
        times = table[:, 0] + rows.to_server
        known = np.abs(times) <= MAX_TIME
        table, times = table[known], times[known]
        if not len(times):
            return []
        steps = np.floor(times * PLOT_HZ)
        last = self._plotted.get(rows.user, -math.inf)
        chosen = np.flatnonzero(np.diff(steps, prepend=last) > 0)
        self._plotted[rows.user] = float(steps[-1])
        form, places = _plot_form(columns)
        values = table[chosen][:, places]
        with np.errstate(over="ignore"):
            sizes = np.sqrt((values[:, 3:6] ** 2).sum(axis=1))
        values = np.column_stack([times[chosen], sizes, values])
        topic = f"/user/{rows.user}/plot"
        found = list[Drawn]()
        for row in values.tolist():
            text = form % tuple(row)
            if not all(map(math.isfinite, row)):
                text = _NOT_FINITE.sub("null", text)
            found.append(Drawn(topic, PLOT, row[0], text.encode()))
        return found

    def _hands(self, shown: Shown) -> list[Drawn]:
        if not shown.t - self._scene > 0.9 / HANDS_HZ:  # ticks are not exactly in time
            return []
        try:
            users = decode_users(shown.frame).users
        except RemoteProtocolError:
            return []
        self._scene = shown.t
        time = self._time(shown.t)
        entities = [
            _hand(touch, time, self._names.get(touch.user, str(touch.user)))
            for touch in users
            if all(abs(each) <= _DRAWABLE for each in (*touch.probe, *touch.force))
        ]
        text = f'{{"deletions":[],"entities":[{",".join(entities)}]}}'
        return [Drawn("/hands", SCENE_UPDATE, shown.t, text.encode())]

    def _object(self, mesh: Mesh) -> list[Drawn]:
        """Return the resting surface, if it is one that Foxglove can take."""
        try:
            # Both kinds of frames are of one layout, and each refuses the other.
            try:
                surface: RestMesh | QuantisedMesh = RestMesh.decode(mesh.frame)
            except RemoteProtocolError:
                surface = QuantisedMesh.decode(mesh.frame)
        except RemoteProtocolError:
            return []
        points = np.asarray(surface.vertices, float).reshape(-1, 3)
        if len(points) > MAX_VERTICES:
            return []
        triangles = {
            "pose": _POSE,
            "points": [_vector(point) for point in points.round(6).tolist()],
            "color": {"r": 0.8, "g": 0.75, "b": 0.7, "a": 0.6},
            "colors": [],
            "indices": np.asarray(surface.faces, int).ravel().tolist(),
        }
        entity = _entity("object", self._time(mesh.t), lifetime=0.0, triangles=[triangles])
        message = {"deletions": [], "entities": [entity]}
        return [Drawn("/object", SCENE_UPDATE, mesh.t, _json(message))]

    def _frame(self, info: SessionInfo) -> Drawn:
        message = {
            "timestamp": self._time(info.t),
            "parent_frame_id": "world",
            "child_frame_id": FRAME,
            "translation": _vector((0.0, 0.0, 0.0)),
            "rotation": _POSE["orientation"],
        }
        return Drawn("/tf", FRAME_TRANSFORM, info.t, _json(message))

    def _log(self, t: float, name: str, text: str) -> Drawn:
        message = {
            "timestamp": self._time(t),
            "level": _INFO,
            "message": text,
            "name": name,
            "file": "",
            "line": 0,
        }
        return Drawn("/log", LOG, t, _json(message))

    def _time(self, t: float) -> dict[str, int]:
        """Return a time as Foxglove has it, since the epoch of Unix."""
        whole = nanoseconds(t, self._to_wall)
        return {"sec": whole // 10**9, "nsec": whole % 10**9}


_POSE = {
    "position": {"x": 0.0, "y": 0.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
}
_PARTS = (
    "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models",
)  # fmt: skip


def _entity(
    name: str, timestamp: Mapping[str, int] | str, *, lifetime: float, **parts: Sequence[Any]
) -> dict[str, Any]:
    """Return a `foxglove.SceneEntity`; a lifetime of 0 is for ever [s]."""
    seconds = int(lifetime)
    return {
        "timestamp": timestamp,
        "frame_id": FRAME,
        "id": name,
        "lifetime": {"sec": seconds, "nsec": round(1e9 * (lifetime - seconds))},
        "frame_locked": False,
        "metadata": [],
        **{part: parts.get(part, []) for part in _PARTS},
    }


def _form(value: Mapping[str, Any]) -> str:
    """Return a mapping's JSON as a form: "#" stands for a number, "!" for JSON to be put in."""
    text = _ENCODER.encode(value).replace("%", "%%")
    return text.replace('"#"', "%.8g").replace('"!"', "%s")


def _hand(touch: UserRecord, time: Mapping[str, int], name: str) -> str:
    """Return the entity of a hand as JSON: a sphere, its name above it, and the force."""
    colour = _COLOUR_TEXTS[(touch.user - 1) % len(_COLOURS)]
    x, y, z = touch.probe
    size = norm(touch.force)
    arrow = ""
    if size >= _BLUNT:
        length = METRES_PER_NEWTON * size
        turn = _turned(touch.force, size)
        arrow = _ARROW % (x, y, z, *turn, 0.8 * length, 0.2 * length, colour)
    return _HAND % (
        _ENCODER.encode(time), touch.user, arrow, x, y, z, colour, x, y, z + 0.012,
        _ENCODER.encode(name),
    )  # fmt: skip


def _turned(force: Vec3, size: float) -> tuple[float, float, float, float]:
    """Return the quaternion x, y, z, w of a turn of the x axis, along which arrows point."""
    x, y, z = (component / size for component in force)
    # Half-way quaternion (1 + e.f, e x f); behind the x axis any half turn about another will do.
    w = 1.0 + x
    if w < 1e-9:
        return 0.0, 0.0, 1.0, 0.0
    length = math.sqrt(w * w + y * y + z * z)
    return 0.0, -z / length, y / length, w / length


def _vector(point: Sequence[float]) -> dict[str, float]:
    x, y, z = (round(each, 6) for each in point)  # 1 um is less than a pixel
    return {"x": x, "y": y, "z": z}


@lru_cache(maxsize=64)
def _plot_form(columns: tuple[str, ...]) -> tuple[str, list[int]]:
    """Return a plot's JSON as a form for numbers, and the places of those after time and size.

    Filling in a form takes a third of the time of encoding a mapping. Six digits are more than a
    plot shows.
    """
    rules = [name for name in columns if name.startswith("by_") or name == "damping"]
    names = [json.dumps(name.removeprefix("by_")).replace("%", "%%") for name in rules]
    vector = '{"x":%.6g,"y":%.6g,"z":%.6g}'
    listed = ",".join(f"{name}:%.6g" for name in names)
    form = f'{{"t":%.6f,"newtons":%.6g,"tip":{vector},"force":{vector},"rules":{{{listed}}}}}'
    return form, [columns.index(name) for name in ("x", "y", "z", "fx", "fy", "fz", *rules)]


_ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


def _json(message: Mapping[str, Any]) -> bytes:
    return _ENCODER.encode(message).encode()


# Forms take a quarter of the time of encoding mappings for every hand anew.
_SPOT = {"x": "#", "y": "#", "z": "#"}
_ARROW = _form(
    {
        "pose": {"position": _SPOT, "orientation": {**_SPOT, "w": "#"}},
        "shaft_length": "#",
        "shaft_diameter": 0.003,
        "head_length": "#",
        "head_diameter": 0.006,
        "color": "!",
    }
)
_HAND = _form(
    _entity(
        "hand NUMBER",
        "!",
        lifetime=4.0 / HANDS_HZ,
        arrows=["!"],
        spheres=[
            {
                "pose": {"position": _SPOT, "orientation": _POSE["orientation"]},
                "size": {"x": 0.008, "y": 0.008, "z": 0.008},
                "color": "!",
            }
        ],
        texts=[
            {
                "pose": {"position": _SPOT, "orientation": _POSE["orientation"]},
                "billboard": True,
                "font_size": 12.0,
                "scale_invariant": True,
                "color": {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0},
                "text": "!",
            }
        ],
    )
).replace("hand NUMBER", "hand %d")
_COLOUR_TEXTS = [_ENCODER.encode({"r": r, "g": g, "b": b, "a": 1.0}) for r, g, b in _COLOURS]
