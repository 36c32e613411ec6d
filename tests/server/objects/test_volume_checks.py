"""Volume meshes as programs write them: mended where that is safe, else refused with the place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.errors import BodyError
from cohaptic_server.mesh.tetrahedra import TetMesh, volumes
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.auto.resolve import find_problems
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.objects.surface import checks
from cohaptic_server.objects.volume_checks import PiecesError, check_conforming, mended
from cohaptic_server.objects.volume_file import VolumeMesh, read_volume

KUHN = [(0, 1, 3, 7), (0, 1, 5, 7), (0, 2, 3, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 4, 6, 7)]


def block(
    cells: tuple[int, int, int],
    low: tuple[float, float, float] = (0, 0, 0),
    high: tuple[float, float, float] = (1, 1, 1),
) -> tuple[Floats, Ints]:
    """A box of cells, each cut into six tetrahedra, as vertices and tetrahedra."""
    ticks = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells, strict=True)]
    x = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    _, ny, nz = (n + 1 for n in cells)
    corners = np.array([i * ny * nz + j * nz + k for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    start = np.array([(i * ny + j) * nz + k for i, j, k in np.ndindex(*cells)])
    tets = (start[:, None, None] + corners[np.array(KUHN)]).reshape(-1, 4)
    turned = volumes(x, tets) < 0.0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    return x, tets


def joined(*some: tuple[Floats, Ints]) -> tuple[Floats, Ints]:
    starts = np.cumsum([0, *(len(x) for x, _ in some)])
    tets = [t + start for (_, t), start in zip(some, starts, strict=False)]
    return np.concatenate([x for x, _ in some]), np.concatenate(tets)


def read(
    path: Path, mesh: tuple[Floats, Ints], *, largest: bool = False, **more: Any
) -> VolumeMesh:
    whole: Any = meshio.Mesh(mesh[0], [("tetra", mesh[1])], **more)
    whole.write(path)
    return read_volume(path, largest=largest)


def volume(mesh: VolumeMesh) -> float:
    return TetMesh.checked(mesh.x, mesh.tets).volume


def test_points_of_each_cell_are_one_point_where_they_meet(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    x, tets = block((2, 2, 2))
    apart = x[tets].reshape(-1, 3)
    apart *= 1.0 + 1e-3 * np.pi  # no corner lies on the grid in which points are compared
    apart += 1e-9 * np.random.default_rng(0).uniform(-1.0, 1.0, apart.shape)
    found = read(tmp_path / "a.vtu", (apart, np.arange(len(apart)).reshape(-1, 4)))
    assert len(found.x) == 27
    assert volume(found) == pytest.approx((1.0 + 1e-3 * np.pi) ** 3)
    assert "165 points lie at the place of another" in caplog.text


def test_what_is_inside_out_is_turned_and_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    x, tets = block((2, 1, 1))
    tets[3] = tets[3][[1, 0, 2, 3]]
    found = read(tmp_path / "a.vtu", (x, tets))
    assert (volumes(found.x, found.tets) > 0.0).all()
    assert "1 of 12 tetrahedra are inside out" in caplog.text
    caplog.clear()
    read(tmp_path / "b.vtu", (x, block((2, 1, 1))[1][:, [1, 0, 2, 3]]))
    assert "inside out" not in caplog.text  # the whole mesh counts its corners the other way


def test_a_vertex_moved_through_a_face_folds_the_mesh(tmp_path: Path) -> None:
    """Each tetrahedron has a volume again when it is turned, but some lie on others."""
    x, tets = block((2, 2, 2))
    (inner,) = np.flatnonzero((x == 0.5).all(axis=1))
    x[inner] = (0.9, 0.6, 0.8)
    read(tmp_path / "a.vtu", (x, tets))
    x[inner] = (1.4, 0.6, 0.8)
    with pytest.raises(BodyError, match=r"both of their tetrahedra on one side.*; one is at \("):
        read(tmp_path / "b.vtu", (x, tets))


@given(st.permutations(range(4)))
def test_each_order_of_corners_gives_the_same_solid(order: list[int]) -> None:
    x, tets = block((2, 1, 1))
    tets[3] = tets[3][order]
    found, turned, _ = mended(Path("a.vtu"), x, tets)
    check_conforming(Path("a.vtu"), found, turned)
    assert volumes(found, turned).sum() == pytest.approx(1.0)


def test_an_element_of_two_groups_counts_once_in_the_first(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    x, tets = block((2, 1, 1))
    both = np.concatenate([tets, tets[:6]])
    groups = np.array([1] * 6 + [2] * 6 + [3] * 6)
    found = read(tmp_path / "a.vtu", (x, both), cell_data={"material": [groups]})
    assert volume(found) == pytest.approx(1.0)
    assert found.parts is not None
    assert found.parts.names[:2] == ("1", "2")
    assert np.bincount(found.parts.of).tolist()[:2] == [6, 6]
    assert "6 tetrahedra are there more than once" in caplog.text


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (
            joined(block((2, 2, 2)), block((1, 1, 1), (1, 0, 0), (2, 1, 1))),
            r"hang together by edges or corners only.* at \(1, [01], [01]\)",
        ),
        (
            joined(block((1, 1, 1)), block((1, 1, 1), (1, 1, 0), (2, 2, 1))),
            r"its 2 pieces hang together .* at \(1, 1, [01]\)",
        ),
        (
            joined(block((1, 1, 1)), block((1, 1, 1), (1, 1, 1), (2, 2, 2))),
            r"its 2 pieces hang together .* at \(1, 1, 1\)",
        ),
        (joined(block((2, 2, 2)), block((1, 1, 1), (0, 0, 0), (0.5, 0.5, 2))), "overlap|cross"),
    ],
    ids=["mismatch", "edge", "corner", "overlap"],
)
def test_what_does_not_fit_together_is_refused_with_its_place(
    tmp_path: Path, mesh: tuple[Floats, Ints], words: str
) -> None:
    with pytest.raises(BodyError, match=words):
        read(tmp_path / "a.vtu", mesh)


def test_a_crack_within_one_piece_is_found(tmp_path: Path) -> None:
    """Two blocks of other fineness lie on a third, and their common side is cracked."""
    base = block((3, 2, 2), (0, 0, 0), (1.5, 1, 1))
    left = block((1, 2, 2), (0, 0, 1), (0.5, 1, 2))
    right = block((2, 2, 3), (0.5, 0, 1), (1.5, 1, 2))
    with pytest.raises(BodyError, match="faces cross others or lie on them without being shared"):
        read(tmp_path / "a.vtu", joined(base, left, right))


def test_faces_too_many_to_compare_are_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checks, "_MAX_PAIRS", 10)
    with pytest.raises(BodyError, match=r"a\.vtu: more than 10 pairs of its triangles lie close"):
        read(tmp_path / "a.vtu", block((2, 2, 2)))


def test_a_heap_of_tetrahedra_is_in_pieces(tmp_path: Path) -> None:
    """Looking for crossings among so many that overlap would not end."""
    corners = np.random.default_rng(0).uniform(size=(20_000, 3))
    with pytest.raises(PiecesError, match="the solid is in 5000 pieces"):
        read(tmp_path / "a.vtu", (corners, np.arange(len(corners)).reshape(-1, 4)))


@pytest.mark.parametrize("shift", [(1.0, 1.0, 1.0), (5.0, 0.0, 0.0)], ids=["corner", "apart"])
def test_a_crumb_beside_the_object_is_left_out_by_those_who_ask(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, shift: tuple[float, float, float]
) -> None:
    low, high = np.array(shift), np.array(shift) + 0.5
    crumb = block((1, 1, 1), tuple(low.tolist()), tuple(high.tolist()))
    path = tmp_path / "a.vtu"
    with pytest.raises(
        PiecesError, match=r"or take the largest alone, 88\.9% of it, with --repair"
    ):
        read(path, joined(block((2, 2, 2)), crumb))
    found = read_volume(path, largest=True)
    assert volume(found) == pytest.approx(1.0)
    assert found.x.max() == 1.0  # no point of the crumb is left
    assert "1 of 2 pieces, with 11.11% of the volume, are left out" in caplog.text
    auto = find_problems(ObjectFile(path))
    assert auto.source.repair
    assert any("2 pieces" in one.problem and one.option == "--repair" for one in auto.remedies)
