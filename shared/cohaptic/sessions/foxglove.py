"""Schemas that Foxglove publishes, as far as session files have messages of them.

Written after `foxglove/foxglove-sdk : schemas/jsonschema`. By these names Foxglove knows what it
can draw.
"""

from __future__ import annotations

import json
from typing import Any

from cohaptic.sessions.schemas import Schema

Json = dict[str, Any]


def _object(title: str, /, **properties: Json) -> Json:
    return {
        "title": title,
        "type": "object",
        "properties": properties,
        "required": list(properties),
    }


def _schema(schema: str, /, **properties: Json) -> Schema:
    text = json.dumps(_object(schema, **properties), sort_keys=True)
    return Schema(schema, "jsonschema", text.encode())


def _array(items: Json) -> Json:
    return {"type": "array", "items": items}


def _numbers(title: str, *names: str) -> Json:
    return _object(title, **{name: _NUMBER for name in names})


_NUMBER: Json = {"type": "number"}
_TEXT: Json = {"type": "string"}
_FLAG: Json = {"type": "boolean"}
_COUNT: Json = {"type": "integer", "minimum": 0}
_NANOSECONDS: Json = {"type": "integer", "minimum": 0, "maximum": 999_999_999}
_TIME = _object("time", sec=_COUNT, nsec=_NANOSECONDS)
_DURATION = _object("duration", sec={"type": "integer"}, nsec=_NANOSECONDS)
_VECTOR = _numbers("foxglove.Vector3", "x", "y", "z")
_POINT = _numbers("foxglove.Point3", "x", "y", "z")
_QUATERNION = _numbers("foxglove.Quaternion", "x", "y", "z", "w")
_COLOUR = _numbers("foxglove.Color", "r", "g", "b", "a")
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION)
_PAIR = _object("foxglove.KeyValuePair", key=_TEXT, value=_TEXT)

_ARROW = _object(
    "foxglove.ArrowPrimitive",
    pose=_POSE,
    shaft_length=_NUMBER,
    shaft_diameter=_NUMBER,
    head_length=_NUMBER,
    head_diameter=_NUMBER,
    color=_COLOUR,
)
_SPHERE = _object("foxglove.SpherePrimitive", pose=_POSE, size=_VECTOR, color=_COLOUR)
_TRIANGLES = _object(
    "foxglove.TriangleListPrimitive",
    pose=_POSE,
    points=_array(_POINT),
    color=_COLOUR,
    colors=_array(_COLOUR),
    indices=_array(_COUNT),
)
_TEXTS = _object(
    "foxglove.TextPrimitive",
    pose=_POSE,
    billboard=_FLAG,
    font_size=_NUMBER,
    scale_invariant=_FLAG,
    color=_COLOUR,
    text=_TEXT,
)
_ANYTHING: Json = {"type": "object"}  # of kinds that no session file has
_ENTITY = _object(
    "foxglove.SceneEntity",
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked=_FLAG,
    metadata=_array(_PAIR),
    arrows=_array(_ARROW),
    cubes=_array(_ANYTHING),
    spheres=_array(_SPHERE),
    cylinders=_array(_ANYTHING),
    lines=_array(_ANYTHING),
    triangles=_array(_TRIANGLES),
    texts=_array(_TEXTS),
    models=_array(_ANYTHING),
)
_DELETION = _object("foxglove.SceneEntityDeletion", timestamp=_TIME, type=_COUNT, id=_TEXT)

SCENE_UPDATE = _schema(
    "foxglove.SceneUpdate", deletions=_array(_DELETION), entities=_array(_ENTITY)
)
FRAME_TRANSFORM = _schema(
    "foxglove.FrameTransform",
    timestamp=_TIME,
    parent_frame_id=_TEXT,
    child_frame_id=_TEXT,
    translation=_VECTOR,
    rotation=_QUATERNION,
)
# UNKNOWN, DEBUG, INFO, WARNING, ERROR, FATAL
_LEVEL: Json = {"type": "integer", "minimum": 0, "maximum": 5}
LOG = _schema(
    "foxglove.Log",
    timestamp=_TIME,
    level=_LEVEL,
    message=_TEXT,
    name=_TEXT,
    file=_TEXT,
    line=_COUNT,
)
