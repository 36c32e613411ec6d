"""Makes the surfaces of an object in a scan: an outer surface, and one for each smaller label.

The outer surface goes round all labels of the object. Each label but the largest has a surface of
its own, which cuts its part out of the object. This surface extends two voxels beyond the object
and into smaller labels, so that two surfaces at the same border cross. Otherwise they would lie a
fraction of a voxel apart, and slivers would fill the gap.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.ndimage

from cohaptic.errors import BodyError
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.objects.checked_cells import checked_cells
from cohaptic_server.objects.parts.parts import PartSurface
from cohaptic_server.objects.scan.choose import (
    MAX_VOXELS,
    Region,
    chosen_labels,
    region_of,
    without_specks,
)
from cohaptic_server.objects.scan.contour import surface_of
from cohaptic_server.objects.scan.label_map import LabelMap
from cohaptic_server.objects.scan.read import read_scan

_BEYOND = 2  # voxels by which a part's surface extends beyond the object and into smaller labels
_MARGIN = _BEYOND + 2
# Blur as a share of a voxel's side: a segmentation places a surface to about half a side.
_BLUR = 0.3
FEWER = 3000  # triangles of all surfaces together, unless the user gives another number


class ScanSurfaces(NamedTuple):
    """Surfaces of an object in a scan.

    Args:
        surfaces: Outer surface of the object [m], then those that cut further parts out of it.
        volumes: Volume of the voxels of each part, in the order of `surfaces`, shape (parts,)
            [m^3].
        blur: Uncertainty of the surfaces' position [m].
        words: Phrases about the voxels: their size, and each change to them.
    """

    surfaces: tuple[PartSurface, ...]
    volumes: Floats
    blur: float
    words: tuple[str, ...]


def scan_surfaces(path: Path, wanted: tuple[str, ...]) -> ScanSurfaces:
    """Read a label map, and make surfaces of some of its labels.

    Args:
        wanted: Labels, as `chosen_labels` takes them.

    Raises:
        SettingError: A wanted label does not exist or is given twice.
        BodyError: The file cannot be read, or a label has no surface.
    """
    whole_map = read_scan(path)
    chosen = chosen_labels(path, whole_map, wanted)
    labels = whole_map.cropped(chosen.labels, _MARGIN, MAX_VOXELS)
    region = region_of(labels, chosen)
    of = _part_of(labels.numbers, region, [1 + labels.labels.index(one) for one in chosen.labels])
    counts = np.bincount(of[region.whole], minlength=len(chosen.names))
    order: list[int] = np.argsort(-counts, kind="stable").tolist()
    names = chosen.names if len(chosen.names) > 1 else ("",)
    found = [PartSurface(names[order[0]], *_surface(path, "", region.whole, labels.affine))]
    for rank, part in enumerate(order[1:], start=1):
        free = np.isin(of, order[rank + 1 :]) | ~region.whole
        cut = _going_on(of == part, free)
        surface = _surface(path, names[part], cut, labels.affine)
        found.append(PartSurface(names[part], *surface))
    words = _words(region, labels, whole_map)
    blur = _BLUR * labels.voxel ** (1.0 / 3.0)
    return ScanSurfaces(
        tuple(found), np.asarray(labels.voxel * counts[order], np.float64), blur, words
    )


def _surface(path: Path, name: str, region: Mask, affine: Floats) -> tuple[Floats, Ints]:
    label = f"label {name}" if name else "the object"
    if not region.any():
        raise BodyError(f"{path}: nothing of {label} is left beside specks")
    try:
        x, faces = surface_of(region, affine)
    except (BodyError, ValueError) as error:
        raise BodyError(f"{path}: {label}: {error}") from error
    return checked_cells(path, x, faces)


def _part_of(
    numbers: npt.NDArray[np.uint16], region: Region, chosen: list[int]
) -> npt.NDArray[np.int8]:
    """Index of the chosen label of each voxel of the object, -1 outside, shape (i, j, k).

    Voxels of filled holes belong to the nearest chosen label.
    """
    table = np.full(int(numbers.max()) + 1, -1, dtype=np.int8)
    for k, number in enumerate(chosen):
        if number < len(table):
            table[number] = k
    of = table[numbers]
    of[~region.whole] = -1
    open_ = region.whole & (of < 0)
    if open_.any():
        transform: Any = scipy.ndimage.distance_transform_edt
        nearest = transform(of < 0, return_distances=False, return_indices=True)
        of = np.where(open_, of[tuple(nearest)], of)
    return of


def _going_on(part: Mask, free: Mask) -> Mask:
    """Part without specks and holes, extended by `_BEYOND` voxels into `free` voxels round it."""
    if not part.any():
        return part
    grown = part = without_specks(part)[0]
    for _ in range(_BEYOND):
        grown = part | (scipy.ndimage.binary_dilation(grown) & (free | part))
    return np.asarray(scipy.ndimage.binary_fill_holes(grown))


def _words(region: Region, labels: LabelMap, original: LabelMap) -> tuple[str, ...]:
    """Phrases about the voxels' size and about each change to them."""
    listed = " x ".join(f"{1e3 * side:.3g}" for side in labels.spacing.tolist())
    coarser = ", of which some were left out" if labels.voxel > 1.01 * original.voxel else ""
    words = [f"voxels of {listed} mm{coarser}"]
    volume = 1e6 * labels.voxel
    if region.specks:
        many = f"{region.specks} specks of" if region.specks > 1 else "a speck of"
        words.append(f"{many} {volume * region.speck_voxels:.2g} cm3 left out")
    if region.hole_voxels:
        words.append(f"holes of {volume * region.hole_voxels:.2g} cm3 filled")
    return tuple(words)
