"""3MF files as people have them, and as somebody hostile makes them."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.mesh.enclosed_volume import volume
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


@pytest.mark.parametrize(
    ("resources", "build", "head", "why"),
    [
        (
            nested(12),
            '<item objectid="12"/>',
            "",
            "4,000,000,000,000 triangles in .* objects; the limits are",
        ),
        (
            '<object id="1"><components><component objectid="1"/></components></object>',
            '<item objectid="1"/>',
            "",
            "more than 50 deep",
        ),
        (
            nested(6).replace(MESH, "<mesh/>"),
            '<item objectid="6"/>',
            "",
            "0 triangles in 1,111,111 objects",
        ),
        (
            nested(1),
            '<item objectid="1"/><item objectid="7"/>',
            "",
            "names object '7', which is not",
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


def in_parts(path: Path, parts: dict[str, str], components: str) -> Path:
    """A 3MF as Bambu Studio writes it, whose meshes lie in parts of their own."""
    whole = f'<object id="9"><components>{components}</components></object>'
    write(path, whole, '<item objectid="9"/>')
    with zipfile.ZipFile(path, "a") as archive:
        for name, resources in parts.items():
            text = f"<model {CORE}><resources>{resources}</resources></model>"
            archive.writestr(name, text)
    return path


FAR = 'transform="1 0 0 0 1 0 0 0 1 20 0 0"'


ONE = f'<object id="1">{MESH}</object>'


@pytest.mark.parametrize(
    ("parts", "names"),
    [
        ({"3D/one.model": nested(0)}, [("0", "one"), ("0", "one")]),
        ({"3D/one.model": nested(0), "3D/two.model": nested(0)}, [("0", "one"), ("0", "two")]),
        ({"3D/one.model": nested(0) + ONE}, [("0", "one"), ("1", "one")]),
    ],
)
def test_objects_are_told_apart_by_part_and_number(
    tmp_path: Path, parts: dict[str, str], names: list[tuple[str, str]]
) -> None:
    """Numbers repeat from part to part, as slicers write them; a mesh may be there twice."""
    components = "".join(
        f'<component objectid="{number}" path="/3D/{part}.model" {moved}/>'
        for (number, part), moved in zip(names, ("", FAR), strict=True)
    )
    path = in_parts(tmp_path / "a.3mf", parts, components)
    x, faces = read_surface(path)
    assert len(faces) == count_triangles(path) == 8
    assert np.ptp(x, axis=0) == pytest.approx([0.03, 0.01, 0.01])


def test_transforms_of_items_and_components_follow_each_other(tmp_path: Path) -> None:
    turn = 'transform="0 1 0 -1 0 0 0 0 1 0 0 0"'  # a quarter about z: x to y, y to -x
    mirror = 'transform="-1 0 0 0 1 0 0 0 1 0 0 0"'
    whole = f'<object id="2"><components><component objectid="1" {FAR}/></components></object>'
    path = write(tmp_path / "a.3mf", ONE + whole, f'<item objectid="2" {turn}/>')
    x, faces = read_surface(path)
    assert x.min(axis=0) == pytest.approx([-0.01, 0.02, 0.0], abs=1e-9)
    assert x.max(axis=0) == pytest.approx([0.0, 0.03, 0.01], abs=1e-9)
    before = volume(x, faces)
    mirrored = read_surface(write(tmp_path / "b.3mf", ONE, f'<item objectid="1" {mirror}/>'))
    assert mirrored[0].min() == pytest.approx(-0.01)
    assert volume(*mirrored) == pytest.approx(before)  # the outside stays outside


@pytest.mark.parametrize(
    "mesh",
    [
        MESH.replace('v2="2"', 'v2="9"'),
        MESH.replace('v2="2"', 'v2="-1"'),
        MESH.replace('v2="2"', ""),
        MESH.replace('x="10"', 'x="ten"'),
    ],
)
def test_a_damaged_mesh_is_refused(tmp_path: Path, mesh: str) -> None:
    path = write(tmp_path / "a.3mf", f'<object id="1">{mesh}</object>', '<item objectid="1"/>')
    with pytest.raises(BodyError, match=r"names vertex|no 3MF that can be read"):
        read_surface(path)


def test_what_a_password_hides_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.3mf", nested(0), '<item objectid="0"/>')
    data = bytearray(path.read_bytes())
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):  # flags, in both headers
        data[data.index(mark) + at] |= 1
    path.write_bytes(data)
    with pytest.raises(BodyError, match=r"this is no 3MF that can be read: .* is encrypted"):
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


NAMED = "http://schemas.microsoft.com/3dmanufacturing/{}"


@pytest.mark.parametrize(
    ("extension", "read"),
    [
        ("production/2015/06", True),
        ("material/2015/02", True),
        ("beamlattice/2017/02", False),
        ("volumetric/2022/01", False),
    ],
)
def test_an_extension_that_the_file_requires_is_known_or_refused_by_name(
    tmp_path: Path, extension: str, read: bool
) -> None:
    path = write(tmp_path / "a.3mf", ONE, '<item objectid="1"/>')
    with zipfile.ZipFile(path) as archive:
        text = archive.read("3D/3dmodel.model").decode()
    declared = f'xmlns:e="{NAMED.format(extension)}" requiredextensions="e" unit'
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/3dmodel.model", text.replace("unit", declared, 1))
    if read:
        assert len(read_surface(path)[1]) == 4
    else:
        with pytest.raises(BodyError, match=f"requires the extension .*{extension}"):
            read_surface(path)


@pytest.mark.parametrize("text", ["<!--{}-->", '<object id="{}">'])
def test_a_tag_without_end_is_refused_before_it_is_read_again_and_again(
    tmp_path: Path, text: str
) -> None:
    path = write(tmp_path / "a.3mf", text.format("a" * (50 * 2**20)), "")
    with pytest.raises(BodyError, match="tag of more than a megabyte"):
        read_surface(path)
