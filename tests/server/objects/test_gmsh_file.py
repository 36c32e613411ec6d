"""Gmsh's files with groups as people save them; a second library writes the plain ones."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.gmsh_file import is_gmsh
from cohaptic_server.objects.volume_file import read_volume
from tests.server.objects.test_volume_checks import block

GROUPS = [1] * 12 + [7] * 12


def saved(path: Path, form: str, binary: bool) -> Path:
    """Four cells in a row, of which two and two are a group, as meshio writes them."""
    x, tets = block((4, 1, 1))
    groups = np.array(GROUPS)
    mesh: Any = meshio.Mesh(
        x,
        [("tetra", tets[groups == tag]) for tag in (1, 7)],
        cell_data={
            name: [groups[groups == tag] for tag in (1, 7)]
            for name in ("gmsh:physical", "gmsh:geometrical")
        },
        field_data={"liver": np.array([1, 3]), "tumour": np.array([7, 3])},
    )
    write: Any = meshio.write  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    write(path, mesh, file_format=form, binary=binary)
    return path


@pytest.mark.parametrize("version", ["1", "3.0", "4.2", "\x1b[2J"])
def test_another_version_is_named(tmp_path: Path, version: str) -> None:
    (tmp_path / "a.msh").write_text(newer().replace("4.1", version))
    with pytest.raises(BodyError, match=r"it is of version .* 2\.2, 4\.0 and 4\.1 are") as error:
        read_volume(tmp_path / "a.msh")
    assert str(error.value).isprintable()


@pytest.mark.parametrize("binary", [False, True])
def test_groups_of_the_older_version_are_parts(tmp_path: Path, binary: bool) -> None:
    path = saved(tmp_path / "a.msh", "gmsh22", binary)
    assert is_gmsh(path.read_bytes())
    found = read_volume(path)
    assert len(found.tets) == 24
    assert found.parts is not None
    assert found.parts.names == ("liver", "tumour")
    assert np.bincount(found.parts.of).tolist() == [12, 12]
    left = found.x[found.tets[found.parts.of == 0]]
    assert left[..., 0].max() == pytest.approx(0.5)


# Two volumes; the second has no group, and the first has two.
ENTITIES = """$Entities
1 1 1 2
9 0 0 0 0
5 0 0 0 1 0 0 0 2 9 -9
3 0 0 0 1 1 0 1 4 1 5
1 0 0 0 1 1 1 {groups} 1 3
2 1 0 0 2 1 1 0 1 3
$EndEntities
"""


def newer(groups: str = "2 1 6") -> str:
    x, tets = block((2, 1, 1))
    nodes = "".join(f"{10 * k + 5}\n" for k in range(len(x)))
    nodes += "".join(f"{a} {b} {c}\n" for a, b, c in x)
    rows = [
        "".join(f"{start + k} {' '.join(str(10 * n + 5) for n in tet)}\n" for k, tet in some)
        for start, some in ((1, list(enumerate(tets[:6]))), (7, list(enumerate(tets[6:]))))
    ]
    return (
        '$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 "liver"\n3 6 "both"\n'
        f"$EndPhysicalNames\n{ENTITIES.format(groups=groups)}"
        f"$Nodes\n1 {len(x)} 5 {10 * len(x)}\n3 1 0 {len(x)}\n{nodes}$EndNodes\n"
        f"$Elements\n3 13 1 13\n2 3 2 1\n13 5 15 25\n3 1 4 6\n{rows[0]}3 2 4 6\n{rows[1]}"
        "$EndElements\n"
    )


def test_what_has_no_group_is_the_rest_and_the_first_of_several_counts(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "a.msh").write_text(newer())
    found = read_volume(tmp_path / "a.msh")
    assert len(found.tets) == 12
    assert found.parts is not None
    assert sorted(found.parts.names) == ["liver", "rest"]
    right = found.x[found.tets[found.parts.of == found.parts.names.index("rest")]]
    assert right[..., 0].min() == pytest.approx(0.5)
    assert "1 of its volumes are in several groups" in caplog.text


@pytest.mark.parametrize("order", ["<", ">"])
def test_the_newer_version_in_binary_is_the_same(tmp_path: Path, order: str) -> None:
    """Written by hand from the specification, in both orders of bytes."""
    x, tets = block((2, 1, 1))

    def ints(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}i", *values)

    def sizes(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}Q", *values)

    def doubles(*values: float) -> bytes:
        return struct.pack(f"{order}{len(values)}d", *values)

    box = doubles(0, 0, 0, 1, 1, 1)
    entities = sizes(0, 0, 0, 2)
    entities += ints(1) + box + sizes(1) + ints(1) + sizes(0)
    entities += ints(2) + box + sizes(0) + sizes(0)
    nodes = sizes(1, len(x), 1, len(x)) + ints(3, 1, 0) + sizes(len(x))
    nodes += sizes(*range(1, len(x) + 1)) + doubles(*x.ravel().tolist())
    elements = sizes(2, 12, 1, 12)
    for volume in (1, 2):
        elements += ints(3, volume, 4) + sizes(6)
        for k, tet in enumerate(tets[6 * (volume - 1) : 6 * volume]):
            elements += sizes(k + 1, *(tet + 1).tolist())
    data = b"$MeshFormat\n4.1 1 8\n" + ints(1) + b"\n$EndMeshFormat\n"
    for name, section in (("Entities", entities), ("Nodes", nodes), ("Elements", elements)):
        data += f"${name}\n".encode() + section + f"\n$End{name}\n".encode()
    (tmp_path / "a.msh").write_bytes(data)
    found = read_volume(tmp_path / "a.msh")
    assert found.x == pytest.approx(x)
    assert (found.tets == tets).all()
    assert found.parts is not None
    assert np.bincount(found.parts.of).tolist() == [6, 6]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("$EndElements", ""), "no mesh that can be read"),
        (("3 2 4 6", "3 2 4 60"), "no mesh that can be read"),
        (("3 2 4 6", "3 2 5 6"), "no mesh that can be read"),
        (("3 2 4 6", "3 2 62 6"), "elements of Gmsh's type 62 are not read"),
        ((" 95 ", " 94 "), "no mesh that can be read"),
        ((" 95 ", " nan "), "a count or a tag is no whole number"),
        ((" 95 ", " 95.5 "), "a count or a tag is no whole number"),
        ((" 95 ", " 1e38 "), r"a count or a tag is beyond 2\^53"),
        (("$Entities", "$PartitionedEntities\n$EndPartitionedEntities\n$Entities"), "partitioned"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path: Path, change: tuple[str, str], words: str) -> None:
    text = newer().replace(*change)
    assert text != newer()
    (tmp_path / "a.msh").write_text(text)
    with pytest.raises(BodyError, match=words) as error:
        read_volume(tmp_path / "a.msh")
    assert str(error.value).startswith(f"{tmp_path / 'a.msh'}: ")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("$Elements\n3 13 1 13", "$Elements\n2 13 1 13", "13 elements, and it has 7"),
        ("$Elements\n3 13 1 13", "$Elements\n3 12 1 13", "12 elements, and it has 13"),
        ("$EndElements", "14 5 15 25 35\n$EndElements", "has 5 numbers more than it counts"),
        ("$EndNodes", "1 2 3\n$EndNodes", "has 3 numbers more than it counts"),
        ("5\n15\n", "5\n5\n", "a node is there twice|names a node that is not there"),
    ],
)
def test_what_stands_behind_a_count_is_not_lost(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    text = newer("1 1")
    assert old in text
    (tmp_path / "a.msh").write_text(text.replace(old, new, 1))
    with pytest.raises(BodyError, match=words):
        read_volume(tmp_path / "a.msh")


@pytest.mark.parametrize("name", ["Elements", "Nodes", "Entities", "PhysicalNames"])
def test_a_section_that_is_there_twice_is_refused(name: str, tmp_path: Path) -> None:
    """As in files that were put together; which one counts is not said anywhere."""
    text = newer("1 1")
    again = text[text.index(f"${name}") : text.index(f"$End{name}")] + f"$End{name}\n"
    (tmp_path / "a.msh").write_text(text + again)
    with pytest.raises(BodyError, match=f"it has two sections {name}"):
        read_volume(tmp_path / "a.msh")


def test_blank_lines_among_the_names_are_read_in_one_pass(tmp_path: Path) -> None:
    text = newer("1 1").replace("$PhysicalNames\n2", "$PhysicalNames\n2" + "\n" * 300_000)
    (tmp_path / "a.msh").write_text(text)
    assert read_volume(tmp_path / "a.msh").parts is not None


def test_an_element_without_end_is_refused(tmp_path: Path) -> None:
    text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n"
    (tmp_path / "a.msh").write_text(f"{text}$Elements\n40000\n99 15 -4 0 0 0\n$EndElements\n")
    with pytest.raises(BodyError, match="no mesh that can be read"):
        read_volume(tmp_path / "a.msh")
