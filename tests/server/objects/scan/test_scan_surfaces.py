from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.enclosed_volume import volume
from cohaptic_server.objects.build import build
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.parts.materials import PartMaterials
from cohaptic_server.objects.scan.scan_surfaces import scan_surfaces
from cohaptic_server.objects.surface.checks import examine
from shapes.phantom import ORGAN, TUMOUR, VESSEL, labels, nifti

for package in ("nibabel", "skimage"):
    pytest.importorskip(package, reason="pip install 'cohaptic[scans]' reads label maps")

SPACING = (3.0, 3.0, 6.0)  # mm


@pytest.fixture
def scan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The phantom, coarser."""
    monkeypatch.setenv("COHAPTIC_CACHE", str(tmp_path / "store"))
    path = tmp_path / "phantom.nii"
    path.write_bytes(nifti(labels()[::2, ::2, ::2].copy(), SPACING))
    return path


def test_a_surface_round_all_and_one_for_each_further_label(scan: Path) -> None:
    found = scan_surfaces(scan, ("1=organ", "2=vessel", "3=tumour"))
    assert [one.name for one in found.surfaces] == ["organ", "vessel", "tumour"]
    values = labels()[::2, ::2, ::2]
    voxel = 1e-9 * float(np.prod(SPACING))
    counts = [(values == label).sum() for label in (ORGAN, VESSEL, TUMOUR)]
    assert found.volumes == pytest.approx(np.array(counts) * voxel, rel=0.03)
    whole = found.surfaces[0]
    assert abs(volume(whole.x, whole.faces)) == pytest.approx(found.volumes.sum(), rel=0.01)
    assert not any(examine(one.x, one.faces).problems() for one in found.surfaces)
    # The vessel comes in from behind: what cuts it out goes on beyond the organ.
    assert found.surfaces[1].x[:, 1].max() > whole.x[:, 1].max() - 0.005
    assert any("speck" in words for words in found.words)


def test_a_scan_too_far_away_for_its_numbers_is_refused(scan: Path) -> None:
    data = bytearray(scan.read_bytes())
    struct.pack_into("<f", data, 292, 1e38)  # x of the first voxel [mm]
    scan.write_bytes(data)
    with pytest.raises(BodyError, match=r"lies 1e\+35 units from the origin .* Move it"):
        scan_surfaces(scan, ("3",))


@pytest.mark.live
def test_labels_become_parts_of_one_solid(scan: Path) -> None:
    pytest.importorskip("pytetwild", reason="pip install 'cohaptic[objects]' fills surfaces")
    source = ObjectFile(
        scan,
        "z < 15%",
        edge=0.1,
        parts=PartMaterials((("3", 5e4), ("2", 1e3))),
        labels=("1", "2", "3"),
        simplify=1000,
    )
    built = build(source)
    assert built.parts is not None
    made = dict(zip(built.parts.names, built.parts.volumes(built.solid.shape.tets), strict=True))
    wanted = dict(zip("123", scan_surfaces(scan, source.labels).volumes, strict=True))
    assert made["1"] == pytest.approx(wanted["1"], rel=0.03)
    assert made["2"] == pytest.approx(wanted["2"], rel=0.2)
    assert made["3"] == pytest.approx(wanted["3"], rel=0.2)
    assert set(built.solid.shape.moduli.young.tolist()) == {1e3, 2e4, 5e4}
    assert built.prepared.words
