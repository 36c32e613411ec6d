from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic.errors import SettingError
from cohaptic_server.objects.scan.choose import chosen_labels, region_of
from cohaptic_server.objects.scan.label_map import LabelMap

PATH = Path("scan.nii")
AFFINE = np.eye(3, 4) * 1e-3


def values() -> npt.NDArray[np.uint8]:
    """A block of two labels with a pinhole, a speck of the first, and a third label elsewhere."""
    found = np.zeros((20, 20, 40), dtype=np.uint8)
    found[2:12, 2:12, 2:12] = 1
    found[4:8, 4:8, 12:15] = 2
    found[5, 5, 5] = 0
    found[16, 16, 3] = 1
    found[3:8, 3:8, 30:38] = 9
    return found


MAP = LabelMap.of(PATH, values(), AFFINE, {2: "vessel"})


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (("3",), r"'3'; it must be labels of this file, which are: 1 \(1 cm3\), 2 vessel"),
        (("1=",), "must be labels of this file"),
        (("1", "1=organ"), "must be given once for each label"),
    ],
)
def test_labels_that_are_not_there_are_told_with_those_that_are(
    wanted: tuple[str, ...], words: str
) -> None:
    with pytest.raises(SettingError, match=words):
        chosen_labels(PATH, MAP, wanted)


def test_specks_are_left_out_and_pinholes_filled() -> None:
    region = region_of(MAP, chosen_labels(PATH, MAP, ("1", "2")))
    assert (region.specks, region.speck_voxels, region.hole_voxels) == (1, 1, 1)
    assert region.whole.sum() == 10**3 + 4 * 4 * 3
    assert region.whole[5, 5, 5]
    assert not region.whole[16, 16, 3]


def test_a_large_cavity_stays() -> None:
    hollow = np.zeros((12, 12, 12), dtype=np.uint8)
    hollow[1:11, 1:11, 1:11] = 1
    hollow[3:9, 3:9, 3:9] = 0
    found = LabelMap.of(PATH, hollow, AFFINE, {})
    region = region_of(found, chosen_labels(PATH, found, ()))
    assert region.hole_voxels == 0
    assert not region.whole[5, 5, 5]


def test_cropping_keeps_voxels_where_they_are() -> None:
    chosen = chosen_labels(PATH, MAP, ("9",))
    cropped = MAP.cropped(chosen.labels, 2, 10**6)
    at = np.argwhere(cropped.numbers == 3) @ cropped.affine[:, :3].T + cropped.affine[:, 3]
    assert at.min(axis=0) == pytest.approx([3e-3, 3e-3, 30e-3])
    assert at.max(axis=0) == pytest.approx([7e-3, 7e-3, 37e-3])
    coarse = MAP.cropped(MAP.labels, 2, 2000)
    assert coarse.spacing == pytest.approx([2e-3] * 3)
