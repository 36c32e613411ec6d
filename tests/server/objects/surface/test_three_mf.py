"""3MF files as people have them, and as somebody hostile makes them."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from cohaptic.errors import BodyError
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.objects.surface.simplify import count_triangles
from cohaptic_server.objects.surface.surface_file import read_surface
from cohaptic_server.objects.surface.three_mf import MAX_BYTES, look_into

CORE = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
MESH = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="10" y="0" z="0"/>'
    '<vertex x="0" y="10" z="0"/><vertex x="0" y="0" z="10"/></vertices><triangles>'
    '<triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>'
    '<triangle v1="1" v2="2" v3="3"/><triangle v1="2" v2="0" v3="3"/></triangles></mesh>'
)


def write(path: Path, resources: str, build: str, unit: str = "millimeter", head: str = "") -> Path:
    """A 3MF with one model."""
    model = (
        f'<?xml version="1.0"?>{head}<model unit="{unit}" {CORE}>'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
    return path


def nested(depth: int) -> str:
    """Objects that each hold the one before ten times: 4 * 10^depth triangles."""
    objects = [f'<object id="0">{MESH}</object>']
    for k in range(1, depth + 1):
        parts = f'<component objectid="{k - 1}"/>' * 10
        objects.append(f'<object id="{k}"><components>{parts}</components></object>')
    return "".join(objects)


@pytest.mark.parametrize(("unit", "metres"), [("millimeter", 1e-3), ("inch", 0.0254), ("meter", 1)])
def test_its_unit_counts(tmp_path: Path, unit: str, metres: float) -> None:
    path = write(tmp_path / "a.3mf", nested(0), '<item objectid="0"/>', unit)
    x, faces = read_surface(path)
    assert np.ptp(x, axis=0) == pytest.approx(10.0 * metres)
    assert len(faces) == count_triangles(path) == 4


def test_what_a_common_program_writes_is_read(tmp_path: Path) -> None:
    x, faces = icosphere(2, 50.0)
    whole: Any = trimesh.Trimesh(x, faces, process=False)
    whole.export(tmp_path / "ball.3mf")
    assert look_into(tmp_path / "ball.3mf") == (1e-3, 320)
    assert np.ptp(read_surface(tmp_path / "ball.3mf")[0], axis=0).max() == pytest.approx(0.1)


def test_objects_count_as_often_as_they_are_built(tmp_path: Path) -> None:
    path = write(tmp_path / "a.3mf", nested(2), '<item objectid="2"/><item objectid="1"/>')
    assert look_into(path).triangles == 440


@pytest.mark.parametrize(
    ("resources", "build", "head", "why"),
    [
        (nested(12), '<item objectid="12"/>', "", "4,000,000,000,000 triangles; the limit is"),
        (
            '<object id="1"><components><component objectid="1"/></components></object>',
            '<item objectid="1"/>',
            "",
            "more than 50 deep",
        ),
        (nested(0), "", '<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>', "entities"),
        ("<object", "", "", "this is no 3MF"),
    ],
)
def test_hostile_ones_are_refused_in_a_sentence(
    tmp_path: Path, resources: str, build: str, head: str, why: str
) -> None:
    path = write(tmp_path / "a.3mf", resources, build, head=head)
    with pytest.raises(BodyError, match=why):
        read_surface(path)


def test_one_object_does_not_hide_another_of_its_name(tmp_path: Path) -> None:
    second = '<object id="12"><components/></object>'
    path = write(tmp_path / "a.3mf", nested(12) + second, '<item objectid="12"/>')
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("3D/other.model", f"<model {CORE}><resources>{second}</resources></model>")
    with pytest.raises(BodyError, match="triangles; the limit is"):
        look_into(path)


def test_what_a_password_hides_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.3mf", nested(0), '<item objectid="0"/>')
    data = bytearray(path.read_bytes())
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):  # flags, in both headers
        data[data.index(mark) + at] |= 1
    path.write_bytes(data)
    with pytest.raises(BodyError, match=r"this is no 3MF that can be read \(RuntimeError"):
        look_into(path)


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "bomb.3mf"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("3D/3dmodel.model", "w", force_zip64=True) as out,
    ):
        for _ in range(MAX_BYTES // 2**20 + 1):
            out.write(bytes(2**20))
    assert path.stat().st_size < 2**20
    with pytest.raises(BodyError, match="the limit is 512 MiB"):
        read_surface(path)


def test_a_unit_that_nobody_knows_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "a.3mf", nested(0), '<item objectid="0"/>', "parsec")
    with pytest.raises(BodyError, match="unit is 'parsec'; known are: micron"):
        read_surface(path)


def test_a_file_that_is_no_zip_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.3mf").write_bytes(b"solid nothing")
    assert count_triangles(tmp_path / "a.3mf") == 0
    with pytest.raises(BodyError, match="this is no 3MF"):
        read_surface(tmp_path / "a.3mf")
