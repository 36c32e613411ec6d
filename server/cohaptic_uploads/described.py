"""Converts the options of an uploaded object to fields of a message, and back; no arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cohaptic.errors import SettingError
from cohaptic_server.objects.object_file import OPTIONS, ObjectFile
from cohaptic_uploads.kept_files import uploads_folder
from cohaptic_uploads.pipe import PipeEnded

# The options that a visitor or the worker chooses; the others have their defaults.
_DESCRIBED = [option for option in OPTIONS if option.page or option.chosen]


def to_fields(source: ObjectFile) -> dict[str, Any]:
    """Return the options of an uploaded object as fields of a message to the server."""
    described = {option.name: option.given(source) for option in _DESCRIBED}
    return {"file": source.path.name, **described}


def from_fields(fields: Mapping[str, Any]) -> ObjectFile:
    """Return the object that the fields describe, with its file in the folder of kept files.

    Folders in the file name are ignored, so that the worker cannot name another file.

    Raises:
        PipeEnded: The fields do not describe an object.
    """
    try:
        given = {option.name: fields[option.name] for option in _DESCRIBED}
        return ObjectFile.of(uploads_folder() / Path(str(fields["file"])).name, given)
    except (KeyError, TypeError, ValueError, OverflowError, SettingError) as error:
        raise PipeEnded(f"what came is no object: {error}") from error
