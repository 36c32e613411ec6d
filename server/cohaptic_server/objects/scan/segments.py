"""Joins the layers of a segmentation of 3D Slicer, in which segments may overlap.

Slicer stores each set of segments that do not overlap as a layer, and says for each segment in
which layer it is and with which value. Where segments overlap the last one counts, as in a label
map that Slicer exports.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cohaptic.errors import BodyError, one_line
from cohaptic_server.objects.memory_limit import say_once
from cohaptic_server.objects.parts.parts import MAX_NAME
from cohaptic_server.objects.scan.label_map import MAX_LABELS

_WAY = (
    "Export a label map from 3D Slicer: Segmentations, Export/import models and labelmaps, Export,"
    " Labelmap; then save that as .nrrd or .nii.gz"
)


class Segment(NamedTuple):
    """A segment of a header.

    Args:
        layer: Layer that has its voxels.
        value: Value of these voxels.
        name: Name, or an empty text.
    """

    layer: int
    value: int
    name: str


def segments_of(header: Mapping[str, Any]) -> list[Segment]:
    """Segments that a header of NRRD lists, in their order.

    Args:
        header: Fields by their names in lower case.

    Raises:
        ValueError: A value or a layer is no whole number.
    """
    found: dict[int, Segment] = {}
    for key, value in header.items():
        match = re.fullmatch(r"segment(\d{1,9})_labelvalue", key)
        if match is not None:
            number = match[1]
            name = one_line(str(header.get(f"segment{number}_name", "")), MAX_NAME)
            layer = int(header.get(f"segment{number}_layer", 0))
            found[int(number)] = Segment(layer, int(value), name)
    return [found[number] for number in sorted(found)]


def joined(
    path: Path, layers: npt.NDArray[Any], segments: list[Segment]
) -> tuple[npt.NDArray[np.uint16], dict[int, str]]:
    """One label map of several layers, and the names of its labels by their values.

    The labels keep their values if no two segments share one; else segments are numbered from 1.

    Args:
        layers: Values of the voxels in each layer, shape (layers, i, j, k).

    Raises:
        BodyError: The segments are not those of the layers, or too many.
    """
    count = len(layers)
    if not segments or any(not 0 <= one.layer < count for one in segments):
        raise BodyError(
            f"{path}: it has {count} layers, as for segments that overlap, and does not say which"
            f" segment is in which. {_WAY}"
        )
    if len(segments) > MAX_LABELS:
        raise BodyError(
            f"{path}: its header lists {len(segments):,} segments; up to {MAX_LABELS:,} are read"
        )
    values = [one.value for one in segments]
    numbers = range(1, len(segments) + 1)
    alone = len(set(values)) == len(values) and all(0 < one < 2**16 for one in values)
    labels = values if alone else list(numbers)
    whole = np.zeros(layers.shape[1:], dtype=np.uint16, order="F")
    overlap, named = 0, 0
    for segment, label in zip(segments, labels, strict=True):
        inside = layers[segment.layer] == segment.value
        overlap += int((whole[inside] != 0).sum())
        named += int(inside.sum())
        whole[inside] = label
    if overlap:
        words = f"{overlap:,} of its voxels are in several segments: each counts in the last one"
        say_once(path, words)
    lost = int((layers != 0).sum()) - named
    if lost:
        raise BodyError(
            f"{path}: {lost:,} of the voxels in its layers are of no segment that its header names,"
            f" or of two with one value. {_WAY}"
        )
    named_as = zip(labels, segments, strict=True)
    return whole, {label: one.name for label, one in named_as if one.name}
