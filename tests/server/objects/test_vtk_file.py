"""All cells of a legacy `.vtk` are read, whatever fields stand behind them, or it is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.volume_file import read_volume
from tests.server.objects.test_vtu_file import BAR, FAR, SOLIDS, VOLUME, volume

COUNT = len(BAR.tets)


class Vtk:
    """Writes a file, section by section."""

    def __init__(self, *, binary: bool = False, version: str = "3.0") -> None:
        self._binary, self.new = binary, version == "5.1"
        form = "BINARY" if binary else "ASCII"
        self.data = f"# vtk DataFile Version {version}\na bar\n{form}\n".encode()

    def line(self, words: str) -> Vtk:
        self.data += words.encode() + b"\n"
        return self

    def numbers(self, values: Any, kind: str) -> Vtk:
        flat: npt.NDArray[Any] = np.asarray(values).ravel()
        if self._binary:
            self.data += flat.astype(kind).tobytes() + b"\n"
        else:
            self.data += " ".join(map(str, flat.tolist())).encode() + b"\n"
        return self

    def texts(self, *words: str) -> Vtk:
        """As VTK: lines, or bytes behind a length, whose first two bits tell its own size."""
        for word in words:
            if not self._binary:
                self.line(word.replace(" ", "%20"))
                continue
            size, mark = next(
                (s, m) for s, m in ((1, 3), (2, 2), (4, 1)) if len(word) < 1 << (8 * s - 2)
            )
            self.data += (mark << (8 * size - 2) | len(word)).to_bytes(size, "big") + word.encode()
        self.data += b"\n" if self._binary else b""
        return self

    def mesh(self, given: list[list[int]] | None = None, types: list[int] | None = None) -> Vtk:
        usual: list[list[int]] = BAR.tets.tolist()
        cells = usual if given is None else given
        self.line(f"DATASET UNSTRUCTURED_GRID\nPOINTS {len(BAR.vertices)} double")
        self.numbers(BAR.vertices, ">f8")
        flat = [n for cell in cells for n in cell]
        if self.new:
            ends = np.cumsum([0, *(len(cell) for cell in cells)])
            self.line(f"CELLS {len(ends)} {len(flat)}\nOFFSETS vtktypeint64").numbers(ends, ">i8")
            self.line("CONNECTIVITY vtktypeint64").numbers(flat, ">i8")
        else:
            self.line(f"CELLS {len(cells)} {len(flat) + len(cells)}")
            self.numbers([n for cell in cells for n in (len(cell), *cell)], ">i4")
        self.line(f"CELL_TYPES {len(cells)}")
        return self.numbers(types or [10] * len(cells), ">i4")

    def read(self, tmp_path: Path) -> Any:
        (tmp_path / "a.vtk").write_bytes(self.data)
        return read_volume(tmp_path / "a.vtk")


FORMS = [(binary, version) for binary in (False, True) for version in ("1.0", "3.0", "4.2", "5.1")]


def with_fields(file: Vtk) -> Vtk:
    """Values of every kind that VTK writes, and the numbers of parts behind them."""
    n = len(BAR.vertices)
    file.line(f"POINT_DATA {n}\nSCALARS number vtktypeint64\nLOOKUP_TABLE default")
    file.numbers(np.arange(n), ">i8").line("VECTORS u float").numbers(np.zeros((n, 3)), ">f4")
    file.line("NORMALS n float").numbers(np.zeros((n, 3)), ">f4")
    file.line("TEXTURE_COORDINATES t 2 float").numbers(np.zeros((n, 2)), ">f4")
    file.line("TENSORS s double").numbers(np.zeros((n, 9)), ">f8")
    file.line(f"FIELD FieldData 2\na%20b 2 {n} double").numbers(np.zeros((n, 2)), ">f8")
    file.line("METADATA\nINFORMATION 0\n").line(f"mask 1 {n} unsigned_char")
    file.numbers(np.zeros(n), ">u1").line("METADATA\nINFORMATION 0\n")
    file.line(f"CELL_DATA {COUNT}\nSCALARS s short 1\nLOOKUP_TABLE hot")
    file.numbers(np.zeros(COUNT), ">i2").line("GLOBAL_IDS id vtkIdType")
    file.numbers(np.arange(COUNT), ">i4")  # VTK writes its own type of ids as four bytes
    file.line("FIELD FieldData 2\nwords 1 4 string").texts("x", "", "a long word " * 9, "b" * 20000)
    file.line(f"material 1 {COUNT} int")
    return file.numbers(FAR, ">i4")


@pytest.mark.parametrize(("binary", "version"), FORMS)
def test_every_version_is_read_with_all_fields(binary: bool, version: str, tmp_path: Path) -> None:
    file = Vtk(binary=binary, version=version).line("FIELD FieldData 1\nwords 2 2 string")
    mesh = with_fields(file.texts("a", "", "c d", "").mesh()).read(tmp_path)
    assert volume(mesh) == pytest.approx(VOLUME)
    assert mesh.parts.names == ("0", "1")
    assert np.array_equal(mesh.parts.of, FAR)


@pytest.mark.parametrize(("binary", "version"), FORMS)
@pytest.mark.parametrize(("kind", "points", "name"), SOLIDS)
def test_no_cell_with_a_volume_is_lost(
    kind: int, points: int, name: str, binary: bool, version: str, tmp_path: Path
) -> None:
    cells = [*BAR.tets.tolist(), list(range(points))]
    file = Vtk(binary=binary, version=version).mesh(cells, [*[10] * COUNT, kind])
    with pytest.raises(BodyError, match=f"would be lost: 1 of {name}.*Tetrahedralize"):
        file.read(tmp_path)


@pytest.mark.parametrize("binary", [False, True])
def test_an_unknown_field_is_said_and_the_mesh_is_whole(
    binary: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = Vtk(binary=binary).mesh().line(f"CELL_DATA {COUNT}\nNOVELTIES a int")
    assert volume(file.read(tmp_path)) == pytest.approx(VOLUME)
    assert "its values from 'NOVELTIES' on are not read" in caplog.text


TEXT = Vtk().mesh().data.decode()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("CELLS 96 480", "CELLS 95 480", "cells have 475 of 480 numbers"),
        ("CELLS 96 480", "CELLS 95 475", "'4' stands where a section|no mesh that can be read"),
        ("CELLS 96 480", "CELLS 97 480", "97 cells do not fit into 480"),
        ("CELL_TYPES 96", "CELL_TYPES 95", "'10' stands where a section should begin"),
        ("CELL_TYPES 96", "CELL_TYPES 97", "ends after 96 of 97"),
        ("CELL_TYPES 96", "CELL_TYPES 9999999999999", "ends after 96 of 9,999,"),
        ("CELL_TYPES 96", "CELL_TYPES -1", "it counts -1"),
        ("CELL_TYPES", "CELL_KINDS", "'CELL_KINDS' stands where"),
        ("POINTS 45", "POINTS 44", "stands where a section should begin"),
        ("POINTS 45", "POINTS 46", "no mesh that can be read"),
        ("DATASET UNSTRUCTURED_GRID\n", "", "no DATASET"),
        ("DATASET UNSTRUCTURED_GRID\n", "DATASET UNSTRUCTURED_GRID\n" * 2, "two sections DATASET"),
        ("ASCII", "MORSE", "neither ASCII nor BINARY"),
        ("CELL_TYPES 96\n10 ", "CELL_TYPES 96\n1_0 ", "'_' in a number"),
    ],
)
def test_what_does_not_fit_together_is_refused(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    assert old in TEXT
    (tmp_path / "a.vtk").write_text(TEXT.replace(old, new))
    with pytest.raises(BodyError, match=words):
        read_volume(tmp_path / "a.vtk")


def test_a_file_of_many_small_arrays_takes_no_longer_than_its_size(tmp_path: Path) -> None:
    """The rest of the file was once copied for each of them: this one took a minute."""
    count = 60_000
    arrays = "".join(f"a{i} 1 0 int\n" for i in range(count))
    text = TEXT.replace("DATASET", f"FIELD FieldData {count}\n{arrays}DATASET", 1)
    (tmp_path / "a.vtk").write_text(text + " " * 5_000_000)
    assert volume(read_volume(tmp_path / "a.vtk")) == pytest.approx(VOLUME)
