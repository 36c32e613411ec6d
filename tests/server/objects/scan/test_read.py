from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.scan import read
from cohaptic_server.objects.scan.read import read_scan
from cohaptic_server.touchable import SCANS
from shapes.phantom import nifti


@pytest.mark.parametrize("name", ["a.nii.gz", "a.nrrd"])
def test_voxels_beyond_the_memory_are_one_sentence(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def takes_too_much(path: Path) -> None:
        raise MemoryError

    for reader in ("read_nifti", "read_nrrd"):
        monkeypatch.setattr(read, reader, takes_too_much)
    with pytest.raises(BodyError, match=f"{name}: its voxels take more memory .* Crop it"):
        read_scan(written(tmp_path / name, b"of any kind"))


SMALL: npt.NDArray[np.uint8] = np.zeros((4, 5, 6), dtype=np.uint8)
SMALL[1:3, 1:4, 2:5] = 7
NRRD = (
    b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 6\nspace: RAS\nencoding: raw\n"
    b"space directions: (1,0,0) (0,1,0) (0,0,1)\n\n"
)


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("name", SCANS)
@pytest.mark.parametrize("data", [nifti(SMALL), NRRD + SMALL.tobytes("F")])
@pytest.mark.parametrize("packed", [0, 1, 2])
def test_format_and_packing_are_those_of_the_first_bytes(
    name: str, data: bytes, packed: int, tmp_path: Path
) -> None:
    """Browsers unpack a file and keep its name; servers pack what is packed already."""
    for _ in range(packed):
        data = gzip.compress(data)
    (label,) = read_scan(written(tmp_path / f"a{name}", data)).labels
    assert (label.value, label.voxels) == (7, 18)


@pytest.mark.parametrize("name", SCANS)
@pytest.mark.parametrize(
    ("data", "words"),
    [
        (gzip.compress(b"ISO-10303-21;\nHEADER;\n"), "it is a STEP file"),
        (gzip.compress(bytes(128) + b"DICM" + bytes(90)), "it is a DICOM file"),
        (gzip.compress(b""), "nothing can be unpacked from it"),
        (gzip.compress(bytes(9000))[:20], "nothing can be unpacked|that can be read"),
        (b"\x1f\x8b\x08nonsense" * 90, "that can be read"),
        (gzip.compress(gzip.compress(gzip.compress(nifti(SMALL)))), "that can be read"),
    ],
)
def test_what_is_packed_is_named_too(name: str, data: bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(BodyError, match=words):
        read_scan(written(tmp_path / f"a{name}", data))
