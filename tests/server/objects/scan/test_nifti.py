from __future__ import annotations

import gzip
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.scan.nifti import read_nifti
from shapes.phantom import nifti

pytest.importorskip("nibabel", reason="pip install 'cohaptic[scans]' reads NIfTI")

SMALL: npt.NDArray[np.uint8] = np.zeros((4, 5, 6), dtype=np.uint8)
SMALL[1:3, 1:4, 2:5] = 7


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def test_labels_have_their_volume_and_box(tmp_path: Path) -> None:
    found = read_nifti(written(tmp_path / "a.nii", nifti(SMALL, (1.0, 2.0, 3.0))))
    (label,) = found.labels
    assert (label.value, label.name, label.voxels) == (7, "7", 18)
    assert label.box.tolist() == [[1, 3], [1, 4], [2, 5]]
    assert found.spacing == pytest.approx([1e-3, 2e-3, 3e-3])
    assert found.voxel == pytest.approx(6e-9)
    assert found.size(label) == pytest.approx([2e-3, 6e-3, 9e-3])
    assert found.said(label) == "7 (0.108 cm3)"


def changed(offset: int, form: str, *values: Any) -> bytes:
    data = bytearray(nifti(SMALL))
    struct.pack_into(form, data, offset, *values)
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no NIfTI that can be read"),
        (b"n+1\0" * 200, "no NIfTI that can be read"),
        (nifti(SMALL)[:-20], "its header says 120 bytes of voxels and it has 100"),
        (changed(40, "<8h", 3, 30000, 30000, 30000, 1, 1, 1, 1), r"takes 8.1e\+04 GB"),
        (changed(40, "<8h", 4, 4, 5, 3, 2, 1, 1, 1), "its voxels are 4 x 5 x 3 x 2"),
        (changed(112, "<2f", 0.5, 3.0), "a voxel is 6.5 .scaled by 0.5 and shifted by 3"),
        (changed(70, "<2h", 128, 24), "a label map has whole numbers|no NIfTI"),
        (changed(280, "<f", float("nan")), "no place of the voxels|no NIfTI"),
        (changed(280, "<4f", 0.0, 0.0, 0.0, 0.0), "its voxels are 0 x"),
        (changed(344, "4s", b"ni1"), "its voxels are in another file"),
        (changed(108, "<f", 3e9), "its voxels begin at byte 3,000,000,000; it has 348"),
        (changed(108, "<f", -3.0), "no NIfTI that can be read"),
        (nifti(np.zeros((3, 3, 3), dtype=np.uint8)), "there is no label in it"),
    ],
)
def test_what_is_no_label_map_is_one_sentence(tmp_path: Path, data: bytes, words: str) -> None:
    with pytest.raises(BodyError, match=words) as error:
        read_nifti(written(tmp_path / "a.nii", data))
    assert "\n" not in str(error.value)


def test_an_image_that_is_not_segmented_is_refused(tmp_path: Path) -> None:
    values = np.arange(4 * 5 * 60, dtype=np.float32).reshape(4, 5, 60)
    with pytest.raises(BodyError, match="more than 1,000 different values"):
        read_nifti(written(tmp_path / "a.nii", nifti(values, code=16)))
    with pytest.raises(BodyError, match=r"a voxel is 0\.5; a label map has whole numbers"):
        read_nifti(written(tmp_path / "b.nii", nifti(0.5 * SMALL.astype(np.float32) / 7, code=16)))


def test_a_bomb_is_refused_by_its_header_before_it_is_unpacked(tmp_path: Path) -> None:
    data = changed(40, "<8h", 3, 2000, 2000, 2000, 1, 1, 1, 1) + bytes(10**7)
    path = written(tmp_path / "a.nii.gz", gzip.compress(data))
    with pytest.raises(BodyError, match=r"2000 x 2000 voxels of 1 bytes; .* takes 24"):
        read_nifti(path)


def test_what_lies_between_header_and_voxels_is_not_unpacked(tmp_path: Path) -> None:
    """Its length is the file's word: a megabyte could unpack to two thousand there."""
    says = changed(348, "<4B", 1, 0, 0, 0)[:352] + struct.pack("<2i", 2**30, 6)
    bomb = changed(108, "<f", 352.0 + 16.0)[:348] + says[348:] + bytes(8) + SMALL.tobytes("F")
    path = written(tmp_path / "a.nii.gz", gzip.compress(bomb + bytes(3 * 10**7)))
    tracemalloc.start()
    try:
        found = read_nifti(path)
        assert tracemalloc.get_traced_memory()[1] < 10**7
    finally:
        tracemalloc.stop()
    assert [label.voxels for label in found.labels] == [18]


@pytest.mark.parametrize("order", ["<", ">"])
def test_the_second_version_and_the_other_order_of_bytes_are_read(
    tmp_path: Path, order: str
) -> None:
    nibabel = pytest.importorskip("nibabel")
    header = nibabel.Nifti2Header(endianness=order)
    header.set_data_dtype(np.int16)
    path = tmp_path / "a.nii.gz"
    nibabel.Nifti2Image(
        SMALL.astype(f"{order}i2"), np.diag([1.0, 2.0, 3.0, 1.0]), header
    ).to_filename(path)
    found = read_nifti(path)
    assert np.array_equal(found.numbers > 0, SMALL == 7)
    assert found.spacing == pytest.approx([1e-3, 2e-3, 3e-3])


MATRIX = np.diag([1.0, 2.0, 3.0, 1.0])
MIRRORED = np.diag([-1.0, 2.0, 3.0, 1.0])


def placed(path: Path, sform: Any, qform: Any, pixdim: tuple[float, ...] = ()) -> Path:
    """A file with two forms, of which either may be missing, and another spacing beside."""
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(SMALL, np.eye(4))
    image.set_sform(sform, code=1 if sform is not None else 0)
    image.set_qform(qform, code=1 if qform is not None else 0)
    data = bytearray(image.to_bytes())
    if pixdim:
        struct.pack_into("<3f", data, 80, *pixdim)
    return written(path, bytes(data))


@pytest.mark.parametrize(
    ("sform", "qform", "pixdim", "words"),
    [
        (MATRIX, MIRRORED, (), "the place of the voxels twice, and differently (by up to 7"),
        (MATRIX, MATRIX + 9.0 * np.eye(4, k=3), (), "twice, and differently (by up to 9"),
        (MATRIX, MATRIX @ np.diag([1.0, 1.0, 1.3, 1.0]), (), "twice, and differently"),
        (None, None, (), "no place of the voxels (no sform, no qform)"),
        (MATRIX, None, (1.0, 2.0, 5.0), "twice, as 1 x 2 x 5 and, by the sform, as 1 x 2 x 3"),
        (MATRIX, None, (1.0, float("nan"), 3.0), "twice, as 1 x nan x 3"),
        (MATRIX, MATRIX, (), ""),
        (MATRIX, MATRIX + 0.2 * np.eye(4, k=3), (), ""),
        (MATRIX, None, (), ""),
        (None, MIRRORED, (), ""),
    ],
)
def test_what_a_header_says_twice_or_not_at_all_is_told(
    sform: Any,
    qform: Any,
    pixdim: tuple[float, ...],
    words: str,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    if sform is not None and qform is None and not pixdim:
        pixdim = (1.0, 2.0, 3.0)
    found = read_nifti(placed(tmp_path / "a.nii", sform, qform, pixdim))
    assert words in caplog.text
    assert bool(caplog.text) == bool(words)
    if sform is not None:
        assert found.affine[:, :3] == pytest.approx(1e-3 * MATRIX[:3, :3])


@pytest.mark.parametrize("off", [0.0, 6e-8, -6e-8, 9e-4, -9e-4])
def test_labels_that_are_whole_but_for_rounding_are_labels(off: float, tmp_path: Path) -> None:
    """Resampling and arithmetic in single precision leave 0.99999994 of 1, and 0.0001 of 0."""
    values = SMALL.astype(np.float32) + np.float32(off)
    found = read_nifti(written(tmp_path / "a.nii", nifti(values, code=16)))
    (label,) = found.labels
    assert (label.value, label.voxels) == (7, 18)


@pytest.mark.parametrize(
    ("slope", "shift", "stored", "value"),
    [(1.0 / 255.0, 0.0, 255, 1), (2.0, 0.0, 7, 14), (1.0, -1.0, 1, -1), (0.0, 5.0, 7, 7)],
)
def test_labels_that_are_scaled_to_whole_numbers_are_labels(
    slope: float, shift: float, stored: int, value: int, tmp_path: Path
) -> None:
    """A slope of 0 says that nothing is scaled."""
    values = np.where(SMALL == 7, stored, 1 if shift == -1.0 else 0).astype(np.uint8)
    values[SMALL == 7] = 0 if shift == -1.0 else stored
    data = bytearray(nifti(values))
    struct.pack_into("<2f", data, 112, slope, shift)
    (label,) = read_nifti(written(tmp_path / "a.nii", bytes(data))).labels
    assert (label.value, label.voxels) == (value, 18)
