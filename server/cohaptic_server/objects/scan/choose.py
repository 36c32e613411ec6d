"""The labels of a scan that become an object, and the regions of voxels that they are."""

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

SPECK = 0.01  # share of the largest piece; smaller pieces and holes are mistakes of a segmentation
MAX_VOXELS = 30_000_000  # of a box round an object, in which pieces and holes are found
_LISTED = 8  # labels in a sentence


class Chosen(NamedTuple):
    """Labels and the names of the parts that they become.

    Args:
        labels: In the order in which they were chosen.
        names: One for each.
    """

    labels: tuple[Label, ...]
    names: tuple[str, ...]


class Region(NamedTuple):
    """What was done to the voxels of an object.

    Args:
        whole: Voxels of the object, shape (i, j, k).
        specks: Pieces that were left out.
        speck_voxels: How many voxels they had.
        hole_voxels: How many voxels inside were filled.
    """

    whole: Mask
    specks: int
    speck_voxels: int
    hole_voxels: int


def chosen_labels(path: Path, labels: LabelMap, wanted: Sequence[str]) -> Chosen:
    """The labels that are named: `3`, a name in the header, or `3=tumour` to name it here.

    Without any the only label of the map is taken.

    Raises:
        SettingError: There is no such label, or it is named twice.
        BodyError: Nothing is named and there are several, or they are too many.
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
    """Labels in a sentence, the first few of many."""
    words = [labels.said(label) for label in some[:_LISTED]]
    more = len(some) - _LISTED
    return ", ".join(words) + (f" and {more} more" if more > 0 else "")


def labels_together(labels: LabelMap) -> tuple[Label, ...]:
    """The labels of the largest piece of all labelled voxels, but for specks of them."""
    numbers = labels.cropped(labels.labels, 1, MAX_VOXELS).numbers
    pieces, counts = _pieces(numbers > 0)
    largest = pieces == int(counts[1:].argmax()) + 1
    within = np.bincount(numbers[largest], minlength=len(labels.labels) + 1)
    enough = SPECK * within.max()
    return tuple(
        label for k, label in enumerate(labels.labels, start=1) if within[k] >= max(1.0, enough)
    )


def region_of(labels: LabelMap, chosen: Chosen) -> Region:
    """The voxels of some labels without specks, and with small holes filled.

    Holes of other labels that were not chosen stay, if they are no specks.
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
    """A region without its small pieces, their number, and that of their voxels."""
    pieces, counts = _pieces(region)
    limit = SPECK * float(counts[1:].max())
    small = np.flatnonzero(counts < limit)
    small = small[small > 0]
    if not len(small):
        return region, 0, 0
    return region & ~np.isin(pieces, small), len(small), int(counts[small].sum())


def _pieces(region: Mask) -> tuple[npt.NDArray[np.int32], Ints]:
    """Number of the piece of each voxel, 0 outside the region, and the voxels of each piece."""
    label: Any = scipy.ndimage.label
    pieces, _ = label(region)
    counts = np.bincount(pieces.ravel(order="K"))
    return pieces, np.asarray(counts, dtype=np.int64)


def _at_border(pieces: npt.NDArray[np.int32]) -> Ints:
    """Numbers of the pieces at the border of a scan, sorted."""
    sides = [pieces[[0, -1]], pieces[:, [0, -1]], pieces[:, :, [0, -1]]]
    return np.unique(np.concatenate([side.ravel() for side in sides])).astype(np.int64)
