"""Description of an object that the worker sends to the server: options, no arrays."""

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
    """The options of an object from an upload."""
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
    """The described object; folders in the file name are ignored, so that the file is a kept one.

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
