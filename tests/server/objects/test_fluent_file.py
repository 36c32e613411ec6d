"""The cells that a mesh of Fluent declares are all read, or it is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from cohaptic.errors import BodyError
from cohaptic_server.objects.volume_file import read_volume
from tests.server.objects.test_vtu_file import BAR, VOLUME, volume

COUNT, POINTS = len(BAR.tets), len(BAR.vertices)


def fluent() -> str:
    """A text in which the cells are given by their corners, to the base 16."""
    points = "".join(" ".join(map(repr, row)) + "\n" for row in BAR.vertices.tolist())
    cells = "".join(" ".join(f"{n + 1:x}" for n in row) + "\n" for row in BAR.tets.tolist())
    return (
        f"(2 3)\n(10 (0 1 {POINTS:x} 0))\n(12 (0 1 {COUNT:x} 0))\n"
        f"(10 (1 1 {POINTS:x} 1 3)(\n{points}))\n(12 (1 1 {COUNT:x} 1 2)(\n{cells}))\n"
    )


def test_its_tetrahedra_are_read(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """What meshio says about sections that it skips is not for our terminal."""
    (tmp_path / "a.msh").write_text(fluent() + "(45 (2 fluid solid)())\n")
    assert volume(read_volume(tmp_path / "a.msh")) == pytest.approx(VOLUME)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (f"(12 (0 1 {COUNT:x} 0))", f"(12 (0 1 {COUNT + 8:x} 0))", "says 104 cells.* have 96"),
        (f"(12 (0 1 {COUNT:x} 0))", f"(12 (0 1 {COUNT:x} 0))\n" * 2, "of its cells twice"),
        ("(12 (1", "(99 (1", "says 96 cells, and its sections have 0"),
        (f"1 {COUNT:x} 1 2)", f"1 {COUNT:x} 1 0)", "it has: 96 of mixed"),
        (f"1 {COUNT:x} 1 2)", f"1 {COUNT:x} 1 4)", "it has: 96 of hexahedron"),
        (f"1 {COUNT:x} 1 2)", f"1 {COUNT:x} 1 7)", "it has: 96 of polyhedron"),
        (f"1 {COUNT:x} 1 2)", f"1 {COUNT:x} 1 9)", "it has: 96 of Fluent's type 9"),
        (f"(12 (0 1 {COUNT:x} 0))", "(2 3)(12 (2 3 4 1 4)())", "it has: 2 of hexahedron"),
        (f"1 {COUNT:x} 1 2)", "1 -3 1 2)", "does not say from which cell"),
        (f"(12 (1 1 {COUNT:x} 1 2)", "(12 (1 5)", "does not say from which cell"),
    ],
)
def test_no_cell_is_lost(old: str, new: str, words: str, tmp_path: Path) -> None:
    text = fluent()
    assert old in text
    (tmp_path / "a.msh").write_text(text.replace(old, new))
    with pytest.raises(BodyError, match=words):
        read_volume(tmp_path / "a.msh")


def test_cells_that_are_given_by_their_faces_are_told(tmp_path: Path) -> None:
    """As Fluent itself writes them: the section of cells has a header and nothing else."""
    text = fluent()
    (tmp_path / "a.msh").write_text(
        f"{text[: text.index('(12 (1')]}(12 (1 1 {COUNT:x} 1 2))\n(13 (2 1 1 3 3)(\n1 2 3 1 0\n))\n"
    )
    with pytest.raises(BodyError, match=r"96 tetrahedra, as faces .* 0 can be read.*ParaView"):
        read_volume(tmp_path / "a.msh")
