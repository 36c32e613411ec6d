"""A label map: the label of each voxel of a scan, and the position of the voxels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.ndimage

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints

# Limit of the voxels as stored and `_NUMBER` further bytes for each: enough for 512 x 512 x 1,000
# voxels of two bytes.
MAX_BYTES = 1_100_000_000
_NUMBER = 2  # bytes of a voxel in `LabelMap.numbers`
MAX_LABELS = 1000  # different labels; an atlas of the whole body has 120
# Largest distance of a label from a whole number: what arithmetic in single precision leaves of
# labels that were scaled, averaged or resampled; an image that is not segmented has all values.
_WHOLE = 1e-3
SAME_SPACING = 0.01  # relative difference of two spacings that are the same but for rounding
_SPACING = (1e-5, 0.1)  # m; least and largest side of a voxel
_LEAST_ANGLE = 0.1  # volume of a voxel over the product of its sides; less if axes are coplanar


@dataclass(frozen=True, eq=False)
class Label:
    """One label of a map.

    Args:
        value: Value of the label's voxels in the file.
        name: Name from the header, or else the value as a text.
        voxels: Number of voxels with the label.
        box: First voxel, and the one after the last, along each axis, shape (3, 2).
    """

    value: int
    name: str
    voxels: int
    box: Ints


@dataclass(frozen=True, eq=False)
class LabelMap:
    """The label of each voxel, and the position of the voxels.

    Args:
        numbers: 0 for the background, else 1 + index into `labels`, shape (i, j, k).
        affine: Map from voxel indices to voxel centres, shape (3, 4) [m].
        labels: Labels sorted by value, without the background.
    """

    numbers: npt.NDArray[np.uint16]
    affine: Floats
    labels: tuple[Label, ...] = field(default=())

    @property
    def spacing(self) -> Floats:
        """Distance between voxels along each axis, shape (3,) [m]."""
        return np.asarray(np.linalg.norm(self.affine[:, :3], axis=0))

    @property
    def voxel(self) -> float:
        """Volume of a voxel [m^3]."""
        return abs(float(np.linalg.det(self.affine[:, :3])))

    def size(self, label: Label) -> Floats:
        """Size of the box round a label along the axes of the patient, shape (3,) [m]."""
        low, high = label.box[:, 0] - 0.5, label.box[:, 1] - 0.5
        corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1)
        return np.asarray(np.ptp(corners.reshape(-1, 3) @ self.affine[:, :3].T, axis=0))

    def said(self, label: Label) -> str:
        """Words for a label with its volume: `3 tumour (12.5 cm3)`."""
        name = f" {label.name}" if label.name != str(label.value) else ""
        return f"{label.value}{name} ({1e6 * self.voxel * label.voxels:.3g} cm3)"

    def cropped(self, labels: Sequence[Label], margin: int, limit: int) -> LabelMap:
        """Crop the map to the box round some labels, to each n-th voxel if there are too many.

        Args:
            labels: Labels of this map.
            margin: Voxels of background round the box.
            limit: Limit of the number of voxels in the box, without the margin.

        Returns:
            A map with the same labels; their boxes and counts refer to the map before cropping.
        """
        boxes = np.stack([label.box for label in labels])
        low, high = boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)
        step = 1
        while np.prod((high - low) / step) > limit:
            step += 1
        window = tuple(slice(int(a), int(b), step) for a, b in zip(low, high, strict=True))
        start = low + 0.0 - margin * step
        affine = self.affine.copy()
        affine[:, 3] += affine[:, :3] @ start
        affine[:, :3] *= step
        return LabelMap(np.pad(self.numbers[window], margin), affine, self.labels)

    @classmethod
    def of(
        cls,
        path: Path,
        values: npt.NDArray[Any],
        affine: Floats,
        names: Mapping[int, str],
        scaling: tuple[float, float] = (1.0, 0.0),
    ) -> LabelMap:
        """Make the label map of the voxels in a file.

        Args:
            path: The file, for an error.
            values: Values of the voxels, shape (i, j, k).
            affine: Map from voxel indices to voxel centres, shape (3, 4) [m].
            names: Names of labels, by their values.
            scaling: Factor of the values, and what is then added; the results are whole numbers.

        Raises:
            BodyError: The values are not those of a label map, or the voxels have no sensible size.
        """
        _check_affine(path, affine)
        known = _values(path, values, scaling)
        labels = known[known != 0]
        if not len(labels):
            raise BodyError(f"{path}: there is no label in it, all voxels are 0")
        # Counting takes eight bytes for each voxel, so it goes slab by slab, in the file's order.
        numbers = np.empty(values.shape, dtype=np.uint16, order="F")
        counts = np.zeros(len(labels) + 1, dtype=np.int64)
        for k in range(values.shape[2]):
            slab = _rounded(_scaled(values[:, :, k], scaling))
            found = np.searchsorted(labels, slab).astype(np.uint16) + 1
            numbers[:, :, k] = np.where(slab == 0, 0, found)
            counts += np.bincount(numbers[:, :, k].ravel(), minlength=len(counts))
        boxes = scipy.ndimage.find_objects(numbers)
        described = tuple(
            Label(
                int(value),
                names.get(int(value), str(int(value))),
                int(counts[k]),
                np.array([[side.start, side.stop] for side in boxes[k - 1]]),
            )
            for k, value in enumerate(labels.tolist(), start=1)
        )
        return cls(numbers, affine, described)


def check_size(path: Path, shape: tuple[int, ...], item: int) -> None:
    """Check, before voxels are read, that they have three axes and fit into memory.

    Args:
        path: The file, for an error.
        shape: Shape that the file's header declares.
        item: Size of a voxel [bytes].

    Raises:
        BodyError: There are too many voxels, or not three axes.
    """
    if len(shape) != 3 or min(shape) < 1:
        axes = " x ".join(str(n) for n in shape[:8]) or "none"
        raise BodyError(f"{path}: its voxels are {axes}; one label map in three axes is read")
    total = int(item) + _NUMBER
    for n in shape:
        total *= int(n)
    if total > MAX_BYTES:
        axes = " x ".join(str(n) for n in shape)
        raise BodyError(
            f"{path}: its header says {axes} voxels of {item} bytes; reading them takes"
            f" {total / 1e9:.3g} GB, and the limit is {MAX_BYTES / 1e9:g} GB. Crop it to"
            " the organ, or resample it"
        )


def _check_affine(path: Path, affine: Floats) -> None:
    if affine.shape != (3, 4) or not np.isfinite(affine).all():
        raise BodyError(f"{path}: its header says no place of the voxels in space")
    spacing = np.linalg.norm(affine[:, :3], axis=0)
    if not ((spacing >= _SPACING[0]) & (spacing <= _SPACING[1])).all():
        listed = " x ".join(f"{1e3 * s:.3g}" for s in spacing.tolist())
        raise BodyError(
            f"{path}: its voxels are {listed} mm; each side must be from {1e3 * _SPACING[0]:g} to"
            f" {1e3 * _SPACING[1]:g} mm"
        )
    if abs(float(np.linalg.det(affine[:, :3] / spacing))) < _LEAST_ANGLE:
        raise BodyError(f"{path}: the axes of its voxels lie in a plane, or nearly so")


def _scaled(values: npt.NDArray[Any], scaling: tuple[float, float]) -> npt.NDArray[Any]:
    factor, shift = scaling
    return values if scaling == (1.0, 0.0) else factor * values.astype(np.float64) + shift


def _rounded(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return np.asarray(np.rint(values) if values.dtype.kind == "f" else values)


def _values(path: Path, values: npt.NDArray[Any], scaling: tuple[float, float]) -> Ints:
    """Different labels of the voxels, sorted; slab by slab, since sorting all takes memory."""
    known: set[int] = set()
    for k in range(values.shape[2]):
        slab = _scaled(np.unique(values[:, :, k]), scaling)
        if slab.dtype.kind == "f":
            wrong = ~(np.abs(slab - np.rint(slab)) <= _WHOLE)
            if wrong.any():
                factor, shift = scaling
                said = f" (scaled by {factor:g} and shifted by {shift:g})"
                raise BodyError(
                    f"{path}: a voxel is {slab[wrong][0]:.9g}"
                    f"{'' if scaling == (1.0, 0.0) else said}; a label map has whole numbers. Is it"
                    " an image that is not segmented yet?"
                )
            if np.abs(slab).max() > 2**31:
                raise BodyError(f"{path}: a voxel is {np.abs(slab).max():g}, too large for a label")
        known.update(int(value) for value in _rounded(slab).tolist())
        if len(known) > MAX_LABELS + 1:
            raise BodyError(
                f"{path}: it has more than {MAX_LABELS:,} different values. Is it an image that is"
                " not segmented yet?"
            )
    if max(abs(value) for value in known) > 2**53:
        raise BodyError(f"{path}: a voxel is {max(known)}, too large for a label")
    return np.array(sorted(known), dtype=np.int64)


def spacings_differ(said: Floats, taken: Floats, by: str) -> str:
    """Words on spacings that a header says twice, and differently.

    Args:
        said: Spacing that is not taken, shape (3,).
        taken: Spacing that is taken, shape (3,), in the same unit.
        by: What says the latter.
    """
    first, second = (" x ".join(f"{side:.4g}" for side in one.tolist()) for one in (said, taken))
    return (
        f"its header says the spacing of the voxels twice, as {first} and, by {by}, as {second}:"
        f" {by} is taken"
    )
