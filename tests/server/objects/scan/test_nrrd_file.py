from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.scan.nrrd_file import read_nrrd

pytest.importorskip("nrrd", reason="pip install 'cohaptic[scans]' reads NRRD")

VALUES: npt.NDArray[np.int16] = np.zeros((3, 4, 5), dtype=np.int16)
VALUES[1:, 1:3, 2:4] = 2
HEAD = """NRRD0004
type: short
dimension: 3
space: left-posterior-superior
sizes: 3 4 5
space directions: (1,0,0) (0,2,0) (0,0,3)
kinds: domain domain domain
endian: little
encoding: raw
space origin: (10,20,30)
Segment0_LabelValue:=2
Segment0_Name:=right kidney
"""


def nrrd(path: Path, head: str = HEAD, data: bytes | None = None) -> Path:
    path.write_bytes(head.encode() + b"\n" + (VALUES.tobytes("F") if data is None else data))
    return path


@pytest.mark.parametrize("packed", [False, True])
def test_a_segmentation_of_slicer_is_read(tmp_path: Path, packed: bool) -> None:
    head = HEAD.replace("raw", "gzip") if packed else HEAD
    data = gzip.compress(VALUES.tobytes("F")) if packed else None
    found = read_nrrd(nrrd(tmp_path / "a.nrrd", head, data))
    (label,) = found.labels
    assert (label.value, label.name, label.voxels) == (2, "right kidney", 8)
    assert np.array_equal(found.numbers > 0, VALUES == 2)
    # Left and posterior become right and anterior.
    assert found.affine == pytest.approx(
        np.array([[-1e-3, 0, 0, -0.01], [0, -2e-3, 0, -0.02], [0, 0, 3e-3, 0.03]])
    )


def test_one_layer_of_segments_is_a_label_map(tmp_path: Path) -> None:
    head = HEAD.replace("dimension: 3", "dimension: 4").replace("sizes: 3", "sizes: 1 3")
    head = head.replace("directions: ", "directions: none ").replace("kinds: ", "kinds: list ")
    assert read_nrrd(nrrd(tmp_path / "a.nrrd", head)).labels[0].voxels == 8
    with pytest.raises(BodyError, match="its voxels are 2 x 3 x 4 x 5; one label map in three"):
        read_nrrd(nrrd(tmp_path / "b.nrrd", head.replace("sizes: 1 3", "sizes: 2 3")))


@pytest.mark.parametrize(
    ("head", "data", "words"),
    [
        ("", b"", "no header of an NRRD ends|no NRRD"),
        (HEAD, b"\0" * 50, "its header says 120 bytes of voxels and it has 50"),
        (HEAD.replace("3 4 5", "30000 30000 30000"), None, r"the limit is 1\.1 GB"),
        (HEAD.replace("3 4 5", "-3 4 5"), None, "its voxels are -3 x 4 x 5"),
        (HEAD.replace("encoding: raw", "encoding: hex"), None, "stored as 'hex'; raw and gzip"),
        (HEAD + "data file: /etc/passwd\n", None, "its voxels are in another file"),
        (HEAD.replace("short", "block"), None, "its voxels are 'block'"),
        (HEAD.replace("short", "x" * 900), None, "its voxels are 'x{20}'"),
        (HEAD.replace("raw", "x" * 900), None, "stored as 'x{20}'"),
        (HEAD.replace("(0,0,3)", "(0,1,0)"), None, "lie in a plane"),
        (HEAD.replace("(10,20,30)", "(1,nan,3)"), None, "says no place of the voxels"),
        (HEAD.replace("(0,0,3)", "(0,0,3000)"), None, r"1 x 2 x 3e\+03 mm; each side must be from"),
        (HEAD.replace("encoding: raw", "encoding: gzip"), b"\x1f\x8bnonsense", "no NRRD"),
    ],
)
def test_what_is_no_label_map_is_one_sentence(
    tmp_path: Path, head: str, data: bytes | None, words: str
) -> None:
    with pytest.raises(BodyError, match=words) as error:
        read_nrrd(nrrd(tmp_path / "a.nrrd", head, data))
    assert "\n" not in str(error.value)


def test_of_a_bomb_no_more_is_unpacked_than_the_header_says(tmp_path: Path) -> None:
    bomb = gzip.compress(VALUES.tobytes("F") + bytes(10**8))
    found = read_nrrd(nrrd(tmp_path / "a.nrrd", HEAD.replace("raw", "gzip"), bomb))
    assert found.labels[0].voxels == 8
