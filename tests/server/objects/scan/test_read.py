from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.scan import read
from cohaptic_server.objects.scan.read import is_scan, read_scan


@pytest.mark.parametrize("name", ["a.nii", "a.nii.gz", "A.NII.GZ", "a.nrrd"])
def test_a_scan_is_known_by_its_name(name: str) -> None:
    assert is_scan(Path(name))
    assert not is_scan(Path(f"{name}.stl"))


@pytest.mark.parametrize("name", ["a.nii.gz", "a.nrrd"])
def test_voxels_beyond_the_memory_are_one_sentence(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def takes_too_much(path: Path) -> None:
        raise MemoryError

    for reader in ("read_nifti", "read_nrrd"):
        monkeypatch.setattr(read, reader, takes_too_much)
    with pytest.raises(BodyError, match=f"{name}: its voxels take more memory .* Crop it"):
        read_scan(Path(name))
