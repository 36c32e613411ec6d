from __future__ import annotations

import gzip
import re
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


def layered(
    path: Path, layers: list[npt.NDArray[np.int16]], segments: str, kind: str = "list"
) -> Path:
    """A file with several layers, as 3D Slicer writes it."""
    head = HEAD[: HEAD.index("Segment0")].replace("dimension: 3", "dimension: 4")
    head = head.replace("sizes: 3", f"sizes: {len(layers)} 3").replace(
        ": domain", f": {kind} domain"
    )
    head = head.replace("directions: ", "directions: none ")
    return nrrd(path, head + segments, np.stack(layers).tobytes("F"))


OTHER: npt.NDArray[np.int16] = np.zeros_like(VALUES)
OTHER[:, 1, 2] = 2
TWO = (
    "Segment0_LabelValue:=2\nSegment0_Name:=kidney\nSegment0_Layer:=0\n"
    "Segment1_LabelValue:=2\nSegment1_Name:=cyst\nSegment1_Layer:=1\n"
)


def test_of_segments_that_overlap_the_last_counts(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    found = read_nrrd(layered(tmp_path / "a.seg.nrrd", [VALUES, OTHER], TWO))
    assert [(one.value, one.name, one.voxels) for one in found.labels] == [
        (1, "kidney", 6),
        (2, "cyst", 3),
    ]
    assert np.array_equal(found.numbers == 2, OTHER == 2)
    assert "2 of its voxels are in several segments" in caplog.text
    # The order is that of the segments' numbers, wherever they stand.
    turned = "\n".join(TWO.splitlines()[::-1]) + "\n"
    again = read_nrrd(layered(tmp_path / "b.seg.nrrd", [VALUES, OTHER], turned))
    assert np.array_equal(again.numbers, found.numbers)


@pytest.mark.parametrize(
    ("segments", "kind", "words"),
    [
        ("", "list", "it has 2 layers, .* Export/import models and labelmaps"),
        (TWO.replace("Layer:=1", "Layer:=2"), "list", "does not say which segment is in which"),
        (TWO.replace("Layer:=1", "Layer:=-1"), "list", "does not say which segment is in which"),
        (TWO[: TWO.index("Segment1")], "list", "3 of the voxels in its layers are of no segment"),
        (TWO.replace("Layer:=1", "Layer:=x"), "list", "no NRRD that can be read"),
        (
            "".join(f"Segment{k}_LabelValue:=2\nSegment{k}_Layer:=0\n" for k in range(1001)),
            "list",
            "lists 1,001 segments; up to 1,000",
        ),
        (TWO, "vector", "its voxels are 2 x 3 x 4 x 5; one label map in three axes"),
        (TWO, "RGB-color", "its voxels are 2 x 3 x 4 x 5; one label map in three axes"),
    ],
)
def test_layers_that_cannot_be_joined_are_refused_with_a_way_out(
    segments: str, kind: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(BodyError, match=words) as error:
        read_nrrd(layered(tmp_path / "a.seg.nrrd", [VALUES, OTHER], segments, kind))
    assert "\n" not in str(error.value)


PLACED = HEAD[HEAD.index("space directions") : HEAD.index("kinds")]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("space: left-posterior-superior", "space dimension: 3", "does not say where left and"),
        ("left-posterior-superior", "scanner-xyz", "says the space 'scanner-xyz', which does not"),
        ("left-posterior-superior", "3D-right-handed", "says the space '3D-right-handed'"),
        (PLACED, "spacings: 1 2 3\n", "does not say where|no space"),
        (PLACED, PLACED + "spacings: 1 2 4\n", "twice, as 1 x 2 x 4 and, by the directions"),
        (PLACED, PLACED + "spacings: 1 2 nan\n", "twice, as 1 x 2 x nan"),
        (PLACED, PLACED + 'space units: "px" "px" "px"\n', "its unit 'px' is not known"),
    ],
)
def test_what_a_header_says_twice_or_not_at_all_is_told(
    old: str, new: str, words: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert old in HEAD
    head = HEAD.replace(old, new)
    if "spacings" in new and old == PLACED and PLACED not in new:
        head = head.replace("space: left-posterior-superior\n", "").replace(
            "space origin: (10,20,30)\n", ""
        )
    found = read_nrrd(nrrd(tmp_path / "a.nrrd", head))
    assert re.search(words, caplog.text)
    assert found.spacing == pytest.approx([1e-3, 2e-3, 3e-3])


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
