"""A volume file is read with the volume of all its cells, or refused, or something is said.

Pieces, arrays, sections and lines of valid files are dropped, repeated, renamed and put in another
order. What is then in the file is counted here by another way than the readers take: each row of
four corners, wherever it stands, is a tetrahedron.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import volumes
from cohaptic_server.objects.volume_file import read_volume
from fuzzing.vtu import Piece, VtuWriter
from tests.examples_of_laws import examples
from tests.server.objects.test_vtk_file import TEXT as VTK
from tests.server.objects.test_vtu_file import ALL, BAR, piece

Rows = list[list[float]]


# What is said of files that are read whole.
_WHOLE = ("are merged with it", "are there more than once", "are inside out")


class _Heard(logging.Handler):
    """Keeps what is said about a file that may have lost something."""

    def __init__(self) -> None:
        super().__init__()
        self.words: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        said = record.getMessage()
        if not any(words in said for words in _WHOLE):
            self.words.append(said)


def _union(tets: Rows) -> float:
    """Volume of tetrahedra, given by the coordinates of their corners, each once."""
    once = {tuple(sorted(zip(*[iter(one)] * 3, strict=True))) for one in tets}
    x = np.array(sorted(once)).reshape(-1, 4, 3)
    return float(np.abs(np.linalg.det(x[:, 1:] - x[:, :1])).sum() / 6.0)


def _holds(path: Path, data: bytes, there: Callable[[bytes], Rows]) -> bool:
    """Check the law for a file; whether it was read without a word."""
    path.write_bytes(data)
    heard = _Heard()
    log = logging.getLogger("cohaptic.server")
    log.addHandler(heard)
    try:
        mesh = read_volume(path)
    except BodyError:
        return False
    finally:
        log.removeHandler(heard)
    found = float(np.abs(volumes(mesh.x, mesh.tets)).sum())
    assert found == pytest.approx(_union(there(data)), rel=1e-6) or heard.words
    return not heard.words


# --- .vtu ---

_LAST = (BAR.vertices[BAR.tets].mean(axis=1)[:, 0] * 40).astype(int)
_VOXEL = Piece(np.array([[i, j, k] for k in (2, 3) for j in (0, 1) for i in (0, 1)]) * 0.06,
               [list(range(8))], [11])  # fmt: skip


def _vtu(order: list[int], voxel: bool, triangles: bool) -> ET.Element:
    pieces = [piece(ALL[k == _LAST]) for k in order if (k == _LAST).any()]
    if triangles:
        pieces = [Piece(p.x, [[0, 1, 2], *p.cells], [5, *p.types]) for p in pieces]
    pieces += [_VOXEL] if voxel else []
    return ET.fromstring(VtuWriter().written(pieces))


def _in_vtu(data: bytes) -> Rows:
    """Tetrahedra of every element that counts cells, whatever its name."""
    rows: Rows = []
    for one in ET.fromstring(data).iter():
        arrays = {a.get("Name"): (a.text or "").split() for a in one.iter("DataArray")}
        if one.get("NumberOfCells") is None:
            continue
        place = one.find("Points/DataArray")
        assert place is not None
        x = np.array((place.text or "").split(), dtype=float).reshape(-1, 3)
        start = 0
        for kind, end in zip(arrays["types"], map(int, arrays["offsets"]), strict=True):
            corners = [int(n) for n in arrays["connectivity"][start:end]]
            start = end
            assert kind in ("5", "10"), "a cell that is lost"
            if kind == "10":
                rows.append(x[corners].ravel().tolist())
    return rows


_EDIT = st.tuples(
    st.sampled_from(["drop", "repeat", "rename", "swap", "cut", "count", "type", "none"]),
    st.integers(0, 10**6),
    st.integers(0, 10**6),
)


def _edited(root: ET.Element, edit: tuple[str, int, int]) -> None:
    """Change one element below the root."""
    what, which, other = edit
    below = [(up, down) for up in root.iter() for down in up]
    if not below:
        return
    above, one = below[which % len(below)]
    if what == "drop":
        above.remove(one)
    elif what == "repeat":
        above.insert(other % (len(above) + 1), one)
    elif what == "rename":
        one.tag = "Other" if other % 2 else one.tag
        one.set("Name", ("types", "offsets", "other")[other % 3])
    elif what == "swap":
        above.remove(one)
        above.insert(other % (len(above) + 1), one)
    elif what == "cut" and one.text:
        words = one.text.split()
        one.text = " ".join(words[: other % (len(words) + 1)])
    elif what == "count" and one.get("NumberOfCells"):
        name = ("NumberOfCells", "NumberOfPoints")[other % 2]
        count = int(one.get(name, "0"))
        one.set(name, str((count + 1, count - 1, count + 10**12, 0)[other % 4]))
    elif what == "type" and one.get("Name") == "types" and (one.text or "").split():
        words = (one.text or "").split()
        words[other % len(words)] = ("11", "12", "14", "42", "99")[other % 5]
        one.text = " ".join(words)


@settings(max_examples=examples(300), deadline=None)
@given(
    st.permutations([-2, -1, 0, 1, 2]),
    st.booleans(),
    st.booleans(),
    st.lists(_EDIT, max_size=3),
)
def test_a_vtu_is_read_with_all_cells_or_not_without_a_word(
    tmp_path_factory: pytest.TempPathFactory,
    order: list[int],
    voxel: bool,
    triangles: bool,
    edits: list[tuple[str, int, int]],
) -> None:
    root = _vtu(order, voxel, triangles)
    for edit in edits:
        _edited(root, edit)
    _holds(tmp_path_factory.mktemp("a") / "a.vtu", ET.tostring(root), _in_vtu)


# --- text of lines: .vtk and .msh ---


def _in_vtk(data: bytes) -> Rows:
    """Rows of five whole numbers from 4 on; the points are those of three numbers before CELLS."""
    words = data.decode().split()
    at = words.index("POINTS")
    x = np.array(words[at + 3 : at + 3 + 3 * int(words[at + 1])], dtype=float).reshape(-1, 3)
    rows = re.findall(rb"^4 (\d+) (\d+) (\d+) (\d+)$", data, re.M)
    types = words[words.index("CELL_TYPES") + 2 :]
    quads = {k for k, kind in enumerate(types) if kind == "9"}  # a count less one is another type
    chosen = [row for k, row in enumerate(rows) if k not in quads]
    return [x[[int(n) for n in row]].ravel().tolist() for row in chosen]


def _in_msh(data: bytes) -> Rows:
    """Rows of the type 4 with two tags, wherever they stand; the nodes are rows of reals."""
    place = {
        int(tag): [float(x), float(y), float(z)]
        for tag, x, y, z in re.findall(rb"^(\d+) (\S*\.\S*) (\S*\.\S*) (\S*\.\S*)$", data, re.M)
    }
    rows = re.findall(rb"^-?\d+ 4 2 \d+ \d+ (\d+) (\d+) (\d+) (\d+)$", data, re.M)
    return [[c for n in row for c in place[int(n)]] for row in rows]


def _msh() -> str:
    nodes = "".join(f"{k} {x!r} {y!r} {z!r}\n" for k, (x, y, z) in
                    enumerate(BAR.vertices.tolist(), 1))  # fmt: skip
    rows = "".join(f"{k} 4 2 1 1 {' '.join(str(n + 1) for n in tet)}\n" for k, tet in
                   enumerate(BAR.tets.tolist(), 1))  # fmt: skip
    return (
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(BAR.vertices)}\n{nodes}$EndNodes\n"
        f"$Elements\n{len(BAR.tets)}\n{rows}$EndElements\n"
    )


def _vtk() -> str:
    """The text of the test beside, with a line for each point and cell."""
    head, rest = VTK.split("POINTS", 1)
    sections: list[str] = []
    for name, width in (("POINTS", 3), ("CELLS", 5), ("CELL_TYPES", 1)):
        line, numbers = re.findall(rf"^({name} [^\n]*)\n([^\n]*)$", "POINTS" + rest, re.M)[0]
        words = numbers.split()
        rows = [" ".join(words[k : k + width]) for k in range(0, len(words), width)]
        sections += [line, *rows]
    return head + "\n".join([*sections, ""])


@settings(max_examples=examples(400), deadline=None)
@given(
    st.sampled_from([("a.vtk", _vtk(), _in_vtk), ("a.msh", _msh(), _in_msh)]),
    st.sampled_from(["drop", "repeat", "swap", "move", "count", "rename", "none"]),
    st.integers(0, 10**6),
    st.integers(0, 10**6),
    st.integers(1, 40),
)
def test_lines_are_read_with_all_cells_or_not_without_a_word(
    tmp_path_factory: pytest.TempPathFactory,
    file: tuple[str, str, Callable[[bytes], Rows]],
    what: str,
    which: int,
    other: int,
    many: int,
) -> None:
    name, text, there = file
    lines = text.splitlines()
    headed = [k for k, line in enumerate(lines) if re.match(r"[A-Z$]|\d+$", line)]
    # As often where a section begins as anywhere else.
    at = headed[which // 2 % len(headed)] if which % 2 else which // 2 % len(lines)
    chosen = lines[at : at + many]
    if what == "drop":
        del lines[at : at + many]
    elif what == "repeat":
        lines[other % len(lines) : other % len(lines)] = chosen
    elif what == "move":
        del lines[at : at + many]
        lines[other % (len(lines) + 1) : other % (len(lines) + 1)] = chosen
    elif what == "swap":
        to = other % len(lines)
        lines[at], lines[to] = lines[to], lines[at]
    elif what == "count":
        more = (1, -1, 10**12, -(10**12))[other % 4]
        lines[at] = re.sub(r"\d+", lambda n: str(int(n[0]) + more), lines[at], count=1)
    elif what == "rename":
        lines[at] = re.sub(r"[A-Z]\w+", ("POINTS", "CELLS", "Nodes", "X")[other % 4], lines[at])
    quiet = _holds(tmp_path_factory.mktemp("a") / name, "\n".join([*lines, ""]).encode(), there)
    assert quiet or what != "none"
