"""Reads the tetrahedra and physical groups of a Gmsh file, version 2.2, 4.0 or 4.1, text or binary.

People save meshes in which some volumes have no physical group, or several. meshio refuses the
first, and gives the elements of the second twice; and it reads behind the end of a file as often as
a damaged count says. Gmsh's own library is under the GPL. The versions differ in little but their
headers, so a reader of one's own is shorter than a patch.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cohaptic.errors import BodyError, one_line
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.memory_limit import named, say_once
from cohaptic_server.objects.volume_cells import VolumeCells, whole

# Number of nodes of each type of element; the first four nodes of a tetrahedron are its corners.
_NODES = {1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 6: 6, 7: 5, 8: 3, 9: 6, 10: 9, 11: 10, 12: 27, 13: 18,
          14: 14, 15: 1, 16: 8, 17: 20, 18: 15, 19: 13, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15,
          25: 21, 26: 4, 27: 5, 28: 6, 29: 20, 30: 35, 31: 56, 92: 64, 93: 125}  # fmt: skip
_TETRAHEDRA = (4, 11, 29, 30, 31)
_SOLIDS = {5: "hexahedron", 6: "wedge", 7: "pyramid", 12: "hexahedron27", 13: "wedge18",
           14: "pyramid14", 17: "hexahedron20", 18: "wedge15", 19: "pyramid13",
           92: "hexahedron64", 93: "hexahedron125"}  # fmt: skip
_FACES = {2: "triangle", 3: "quad", 9: "triangle6", 10: "quad9", 16: "quad8", 20: "triangle9",
          21: "triangle10"}  # fmt: skip
_VOLUME = 3  # dimension of a volume
# Sections that make the mesh; of others, such as results, there may be several.
_ONCE = ("MeshFormat", "Entities", "Nodes", "Elements", "PhysicalNames")
_SECTION = re.compile(rb"\$(\w+)[ \t]*\r?\n")


class GmshMesh(NamedTuple):
    """The elements of a file.

    Args:
        x: Nodes, shape (n, 3).
        cells: Tetrahedra, and the number of all other elements but points and lines.
        groups: Number of each tetrahedron's group, 0 for none, shape (m,).
        names: Names of groups of volumes, by number.
    """

    x: Floats
    cells: VolumeCells
    groups: Ints
    names: dict[int, str]


def is_gmsh(start: bytes) -> bool:
    """Whether the first bytes of a file are those of a file of Gmsh, of any version."""
    return start.lstrip().startswith(b"$")


def read_gmsh(path: Path) -> GmshMesh:
    """Read a file for whose first bytes `is_gmsh` holds.

    Raises:
        BodyError: The version is unknown, the mesh is partitioned, or it has elements of an
            unknown type.
        Exception: The file is damaged; errors of many kinds.
    """
    sections = _sections(path.read_bytes())
    version, binary, size = sections["MeshFormat"].split()[:3]
    if "PartitionedEntities" in sections:
        raise BodyError(f"{path}: it is partitioned. Save it from Gmsh without partitions")
    old = version.startswith(b"2")
    if not old and version not in _NEWER:
        raise BodyError(
            f"{path}: it is of version {one_line(version.decode(errors='replace'), 10)} of Gmsh's"
            " format; 2.2, 4.0 and 4.1 are read. Export it anew as one of these"
        )
    swapped = binary == b"1" and sections["MeshFormat"].split(b"\n", 1)[1][:4] == b"\0\0\0\1"

    def cursor(name: str) -> _Cursor:
        return _Cursor(sections[name], binary == b"1", int(size), ">" if swapped else "<")

    read_nodes, read_elements = (_nodes_2, _elements_2) if old else _NEWER[version]
    at_nodes, at_elements = cursor("Nodes"), cursor("Elements")
    tags, x = read_nodes(at_nodes)
    at_nodes.end()
    group_of: dict[int, int] = {}
    if not old and "Entities" in sections:
        group_of = _entities(path, cursor("Entities"), 3 if version == b"4.1" else 6)
    tets, groups = [np.zeros((0, 4), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    solids, flat = Counter[str](), Counter[str]()
    with named(path):
        for kind, entity, group, nodes in read_elements(at_elements):
            if kind in _SOLIDS:
                solids[_SOLIDS[kind]] += len(nodes)
            elif kind in _FACES:
                flat[_FACES[kind]] += len(nodes)
            elif kind in _TETRAHEDRA:
                tets.append(nodes[:, :4])
                groups.append(group if old else np.full(len(nodes), group_of.get(entity, 0)))
    at_elements.end()
    order = np.argsort(tags, kind="stable")
    again = np.diff(tags[order]) == 0
    if (x[order][1:][again] != x[order][:-1][again]).any():
        raise ValueError("a node is there twice, at different places")
    corners = np.concatenate(tets)
    at = np.searchsorted(tags[order], corners)
    if (tags[order][np.minimum(at, len(tags) - 1)] != corners).any():
        raise ValueError("an element names a node that is not there")
    cells = VolumeCells(order[at], np.arange(len(corners)), solids, flat)
    return GmshMesh(x, cells, np.concatenate(groups), _names(sections))


def _sections(data: bytes) -> dict[str, bytes]:
    """The text or bytes of each section by its name.

    Raises:
        ValueError: A section does not end, or one of the mesh is there twice.
    """
    found: dict[str, bytes] = {}
    start = 0
    while match := _SECTION.search(data, start):
        end = data.find(b"$End" + match[1], match.end())
        if end < 0:
            raise ValueError(f"its section {match[1].decode()} does not end")
        name = match[1].decode()
        if name in found and name in _ONCE:
            raise ValueError(f"it has two sections {name}")
        found[name] = data[match.end() : end]
        start = end + 4 + len(match[1])
    return found


class _Cursor:
    """Numbers of one section, one after another."""

    def __init__(self, data: bytes, binary: bool, size: int, order: str) -> None:
        self._data, self._binary, self._start = data, binary, 0
        self._kinds = {"i": np.dtype(f"{order}i4"), "t": np.dtype(f"{order}u{size}"),
                       "d": np.dtype(f"{order}f8")}  # fmt: skip
        self.text: Floats = np.zeros(0)
        if not binary:
            self.text = np.array(data.split(), dtype=np.float64)

    def skip(self, numbers: int) -> None:
        """Pass over numbers of a text that were read from `text` itself."""
        self._start += numbers

    def head(self) -> int:
        """The count in the first line, which is text in version 2 also where the rest is binary."""
        if not self._binary:
            return int(self.take("i", 1)[0])
        self._start = self._data.index(b"\n") + 1
        return int(self._data[: self._start])

    def take(self, kind: str, count: int) -> Any:
        """The next numbers: `i` for int, `t` for size_t, `d` for double; shape (count,)."""
        if not self._binary:
            found = self.text[self._start : self._start + count]
            self._start += count
        else:
            dtype = self._kinds[kind]
            found = np.frombuffer(self._data, dtype, count, self._start)
            self._start += count * dtype.itemsize
        if count < 0 or len(found) < count:
            raise ValueError(f"a section has {len(found)} numbers of {count}")
        return found if kind == "d" else whole(found)

    def end(self) -> None:
        """Check that all of the section has been read, since its counts may be too low.

        Raises:
            ValueError: There are numbers behind those that are counted.
        """
        left = len(self.text) - self._start
        if not self._binary and left > 0:
            raise ValueError(f"a section has {left:,} numbers more than it counts")
        if self._binary and self._data[self._start :].strip():
            raise ValueError("a section has more bytes than it counts")

    def records(self, kinds: tuple[tuple[str, int], ...], count: int) -> list[Any]:
        """The next `count` records of several numbers: an array (count, n) for each of `kinds`."""
        width = sum(n for _, n in kinds)
        if not self._binary:
            rows = self.take("d", count * width).reshape(count, width)
            ends = np.cumsum([n for _, n in kinds])[:-1]
            parts = np.split(rows, ends, axis=1)
        else:
            fields = [(f"f{k}", self._kinds[kind], (n,)) for k, (kind, n) in enumerate(kinds)]
            rows = np.frombuffer(self._data, np.dtype(fields), count, self._start)
            self._start += rows.nbytes
            parts = [rows[f"f{k}"] for k in range(len(kinds))]
        return [p if kind == "d" else whole(p)
                for (kind, _), p in zip(kinds, parts, strict=True)]  # fmt: skip


def _nodes_2(at: _Cursor) -> tuple[Ints, Floats]:
    tags, x = at.records((("i", 1), ("d", 3)), at.head())
    return tags[:, 0], x


def _nodes_4(at: _Cursor) -> tuple[Ints, Floats]:
    tags, points = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    blocks, total = at.take("t", 4)[:2].tolist()
    for _ in range(blocks):
        dimension, _, parametric = at.take("i", 3).tolist()
        count = int(at.take("t", 1)[0])
        tags.append(at.take("t", count))
        width = 3 + (dimension if parametric else 0)
        points.append(at.take("d", count * width).reshape(count, width)[:, :3])
    _check_total("nodes", sum(map(len, tags)), total)
    return np.concatenate(tags), np.concatenate(points)


def _nodes_40(at: _Cursor) -> tuple[Ints, Floats]:
    tags, points = [np.zeros(0, dtype=np.int64)], [np.zeros((0, 3))]
    blocks, total = at.take("t", 2).tolist()
    for _ in range(blocks):
        _, dimension, parametric = at.take("i", 3).tolist()
        width = 3 + (dimension if parametric else 0)
        some, x = at.records((("i", 1), ("d", width)), int(at.take("t", 1)[0]))
        tags.append(some[:, 0])
        points.append(x[:, :3])
    _check_total("nodes", sum(map(len, tags)), total)
    return np.concatenate(tags), np.concatenate(points)


def _elements_2(at: _Cursor) -> Any:
    """Kind, entity, group of each and nodes (m, n), for runs of elements of one kind."""
    left = at.head()
    if not at._binary:  # pyright: ignore[reportPrivateUsage]  # of this module
        yield from _lines_2(at, left)
        return
    while left > 0:
        kind, count, marks = at.take("i", 3).tolist()
        width = 1 + _checked(marks) + _nodes_of(kind)
        numbers = at.take("i", count * width).reshape(count, width)
        groups = numbers[:, 1] if marks else np.zeros(count, dtype=np.int64)
        yield kind, 0, groups, numbers[:, 1 + marks :]
        left -= max(count, 1)
    if left < 0:
        raise ValueError("it has more elements than its header says")


def _lines_2(at: _Cursor, count: int) -> Any:
    numbers = whole(at.text)
    start, rows = 1, dict[int, list[Any]]()
    for _ in range(count):
        kind, marks = numbers[start + 1 : start + 3].tolist()
        end = start + 3 + _checked(marks) + _nodes_of(kind)
        rows.setdefault(kind, []).append((numbers[start + 3] if marks else 0,
                                          numbers[end - _NODES[kind] : end]))  # fmt: skip
        start = end
    at.skip(start - 1)
    for kind, some in rows.items():
        yield kind, 0, np.array([group for group, _ in some]), np.array([n for _, n in some])


def _elements_4(at: _Cursor) -> Any:
    blocks, total = at.take("t", 4)[:2].tolist()
    count = 0
    for _ in range(blocks):
        dimension, entity, kind = at.take("i", 3).tolist()
        run = _run(at, "t", dimension, entity, kind)
        count += len(run[-1])
        yield run
    _check_total("elements", count, total)


def _elements_40(at: _Cursor) -> Any:
    blocks, total = at.take("t", 2).tolist()
    count = 0
    for _ in range(blocks):
        entity, dimension, kind = at.take("i", 3).tolist()
        run = _run(at, "i", dimension, entity, kind)
        count += len(run[-1])
        yield run
    _check_total("elements", count, total)


def _check_total(what: str, there: int, said: int) -> None:
    if there != said:
        raise ValueError(f"its header says {said:,} {what}, and it has {there:,}")


def _run(at: _Cursor, word: str, dimension: int, entity: int, kind: int) -> Any:
    """Elements of one kind on one entity, whose numbers are of type `word`."""
    count, width = int(at.take("t", 1)[0]), 1 + _nodes_of(kind)
    numbers = at.take(word, count * width).reshape(count, width)
    return kind, entity if dimension == _VOLUME else -1, None, numbers[:, 1:]


_NEWER = {
    b"4": (_nodes_40, _elements_40),
    b"4.0": (_nodes_40, _elements_40),
    b"4.1": (_nodes_4, _elements_4),
}  # readers of nodes and elements


def _nodes_of(kind: int) -> int:
    if kind not in _NODES:
        raise BodyError(
            f"its elements of Gmsh's type {kind} are not read. Save it with elements of order 1 or"
            " 2"
        )
    return _NODES[kind]


def _checked(marks: int) -> int:
    if marks < 0:
        raise ValueError(f"an element with {marks} tags")
    return marks


def _entities(path: Path, at: _Cursor, of_point: int) -> dict[int, int]:
    """Group of each volume by the volume's number: the first, if it has several.

    Args:
        of_point: Number of coordinates that a point has here.
    """
    found: dict[int, int] = {}
    several: list[int] = []
    for dimension, count in enumerate(at.take("t", 4).tolist()):
        for _ in range(count):
            tag = int(at.take("i", 1)[0])
            at.take("d", of_point if dimension == 0 else 6)
            groups = at.take("i", int(at.take("t", 1)[0])).tolist()
            if dimension > 0:
                at.take("i", int(at.take("t", 1)[0]))
            if dimension == _VOLUME and groups:
                found[tag] = abs(groups[0])
                several += [tag] if len(groups) > 1 else []
    if several:
        words = f"{len(several)} of its volumes are in several groups; each counts in the first"
        say_once(path, words)
    return found


def _names(sections: dict[str, bytes]) -> dict[int, str]:
    lines = re.findall(
        rb'^[ \t]*(\d+)[ \t]+(\d+)[ \t]+"(.*)"', sections.get("PhysicalNames", b""), re.M
    )
    return {int(n): name.decode(errors="replace") for dim, n, name in lines if int(dim) == _VOLUME}
