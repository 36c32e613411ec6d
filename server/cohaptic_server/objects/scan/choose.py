"""Chooses the labels of a scan that become an object, and finds their voxels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.ndimage

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.numeric import Ints, Mask
from cohaptic_server.objects.parts.parts import MAX_PARTS, distinct
from cohaptic_server.objects.scan.label_map import Label, LabelMap

# Pieces smaller than this share of the largest one and holes smaller than this share of the object
# are mistakes of a segmentation.
SPECK = 0.01
MAX_VOXELS = 30_000_000  # voxels of the box round an object in which pieces and holes are found
_LISTED = 8  # largest number of labels in a sentence


class Chosen(NamedTuple):
    """Chosen labels and the names of the parts that they become.

    Args:
        labels: Labels in the order in which they were chosen.
        names: Name of the part of each label.
    """

    labels: tuple[Label, ...]
    names: tuple[str, ...]


class Region(NamedTuple):
    """Voxels of an object, and the changes that were made to them.

    Args:
        whole: Whether each voxel is in the object, shape (i, j, k).
        specks: Number of pieces that were left out.
        speck_voxels: Number of voxels in these pieces.
        hole_voxels: Number of voxels of the holes that were filled.
    """

    whole: Mask
    specks: int
    speck_voxels: int
    hole_voxels: int


def chosen_labels(path: Path, labels: LabelMap, wanted: Sequence[str]) -> Chosen:
    """Find the labels that are wanted, such as `3`, a name in the header, or `3=tumour`.

    The last form also names the part. If no label is wanted, the only label of the map is taken.

    Raises:
        SettingError: A wanted label does not exist or is given twice, or its new name is empty.
        BodyError: No label is wanted but the map has several, or too many labels are wanted.
    """
    if not wanted and len(labels.labels) > 1:
        words = listed(labels, labels.labels)
        raise BodyError(
            f"{path}: it has {len(labels.labels)} labels: {words}. Choose with --label"
            f" {labels.labels[0].value}, once for each that is a part, or let --auto choose"
        )
    found: list[Label] = []
    names: list[str] = []
    only = [str(label.value) for label in labels.labels[:1]]
    for text in wanted or only:
        key, equals, name = text.partition("=")
        label = _find(labels, key.strip())
        if label is None or (equals and not name.strip()):
            there = f"labels of this file, which are: {listed(labels, labels.labels)}"
            raise SettingError("--label", repr(text), there)
        if label in found:
            raise SettingError("--label", repr(text), "given once for each label")
        found.append(label)
        names.append(name.strip() if equals else label.name)
    if len(found) > MAX_PARTS:
        raise BodyError(f"{path}: {len(found)} labels are chosen; an object has up to {MAX_PARTS}")
    return Chosen(tuple(found), distinct(names))


def _find(labels: LabelMap, key: str) -> Label | None:
    by_name = [label for label in labels.labels if label.name == key]
    by_value = [label for label in labels.labels if str(label.value) == key]
    found = by_value or by_name
    return found[0] if found else None


def listed(labels: LabelMap, some: Sequence[Label]) -> str:
    """Words for some labels with their volumes; of many labels only the first few."""
    words = [labels.said(label) for label in some[:_LISTED]]
    more = len(some) - _LISTED
    return ", ".join(words) + (f" and {more} more" if more > 0 else "")


def labels_together(labels: LabelMap) -> tuple[Label, ...]:
    """Labels in the largest connected piece of labelled voxels, except labels with a mere speck."""
    numbers = labels.cropped(labels.labels, 1, MAX_VOXELS).numbers
    pieces, counts = _pieces(numbers > 0)
    largest = pieces == int(counts[1:].argmax()) + 1
    within = np.bincount(numbers[largest], minlength=len(labels.labels) + 1)
    enough = SPECK * within.max()
    return tuple(
        label for k, label in enumerate(labels.labels, start=1) if within[k] >= max(1.0, enough)
    )


def region_of(labels: LabelMap, chosen: Chosen) -> Region:
    """Voxels of the chosen labels without specks and with small holes filled.

    Larger holes stay, such as those of voxels whose label was not chosen.
    """
    indices = [1 + labels.labels.index(label) for label in chosen.labels]
    whole, specks, lost = without_specks(
        np.isin(labels.numbers, np.array(indices, dtype=np.uint16))
    )
    holes, counts = _pieces(~whole)
    limit = SPECK * float(whole.sum())
    small = np.flatnonzero(counts < limit)
    filled = np.isin(holes, np.setdiff1d(small[small > 0], _at_border(holes)))
    return Region(whole | filled, specks, lost, int(filled.sum()))


def without_specks(region: Mask) -> tuple[Mask, int, int]:
    """Region without its small pieces, number of these pieces, and number of their voxels."""
    pieces, counts = _pieces(region)
    limit = SPECK * float(counts[1:].max())
    small = np.flatnonzero(counts < limit)
    small = small[small > 0]
    if not len(small):
        return region, 0, 0
    return region & ~np.isin(pieces, small), len(small), int(counts[small].sum())


def _pieces(region: Mask) -> tuple[npt.NDArray[np.int32], Ints]:
    """Piece of each voxel, 0 outside the region, and the number of voxels of each piece."""
    label: Any = scipy.ndimage.label
    pieces, _ = label(region)
    counts = np.bincount(pieces.ravel(order="K"))
    return pieces, np.asarray(counts, dtype=np.int64)


def _at_border(pieces: npt.NDArray[np.int32]) -> Ints:
    """Numbers of the pieces that reach the border of a scan, sorted."""
    sides = [pieces[[0, -1]], pieces[:, [0, -1]], pieces[:, :, [0, -1]]]
    return np.unique(np.concatenate([side.ravel() for side in sides])).astype(np.int64)
