"""Converts the options of an uploaded object to fields of a message, and back; no arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cohaptic.errors import SettingError
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_uploads.kept_files import uploads_folder
from cohaptic_uploads.pipe import PipeEnded


def to_fields(source: ObjectFile) -> dict[str, Any]:
    """Return the options of an uploaded object as fields of a message to the server."""
    material = source.material
    return {
        "file": source.path.name,
        "fix": source.fix,
        "scale": source.scale,
        "edge": source.edge,
        "shell": source.shell,
        "repair": source.repair,
        "simplify": source.simplify,
        "young": material.young,
        "nu": material.nu,
        "order": material.order,
        "labels": list(source.labels),
    }


def from_fields(fields: Mapping[str, Any]) -> ObjectFile:
    """Return the object that the fields describe, with its file in the folder of kept files.

    Folders in the file name are ignored, so that the worker cannot name another file.

    Raises:
        PipeEnded: The fields do not describe an object.
    """
    try:
        return ObjectFile(
            uploads_folder() / Path(str(fields["file"])).name,
            str(fields["fix"]),
            scale=float(fields["scale"]),
            edge=float(fields["edge"]),
            shell=float(fields["shell"]),
            repair=bool(fields["repair"]),
            simplify=int(fields["simplify"]),
            labels=tuple(str(label) for label in fields["labels"]),
            material=SolidSettings(
                float(fields["young"]), float(fields["nu"]), order=int(fields["order"])
            ),
        )
    except (KeyError, TypeError, ValueError, OverflowError, SettingError) as error:
        raise PipeEnded(f"what came is no object: {error}") from error
