from __future__ import annotations

import numpy as np
import pytest

from cohaptic_server.mesh.tetrahedra import face_pieces
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.tetrahedralise import largest_piece
from cohaptic_server.testing.blocks import block

BLOCK = block((0.1, 0.1, 0.1), (3, 3, 3))


def with_one_more(shared: int, size: float) -> tuple[Floats, Ints]:
    """A block and a tetrahedron outside, which shares so many corners of an edge of the block."""
    x = BLOCK.vertices
    low = x.min(axis=0)
    edge = np.flatnonzero(np.isclose(x[:, 1:], low[1:]).all(axis=1))
    edge = edge[np.argsort(x[edge, 0])][:shared]
    base = x[edge[0]] if shared else low - 1.0
    away = base - size * np.array([[0.0, 1.0, 0.1], [0.0, 0.1, 1.0], [1.0, 1.0, 1.0], [1, 2, 0]])
    new = np.arange(4 - shared) + len(x)
    tet = np.concatenate([edge, new])
    return np.concatenate([x, away[: len(new)]]), np.concatenate([BLOCK.tets, tet[None]])


@pytest.mark.parametrize("shared", [0, 1, 2])
def test_what_hangs_on_a_corner_or_an_edge_is_left_out_if_it_is_a_crumb(shared: int) -> None:
    x, tets = with_one_more(shared, 0.005)
    assert np.array_equal(largest_piece(x, tets), BLOCK.tets)
    assert face_pieces(tets).max() == 1
    assert (face_pieces(tets)[:-1] == 0).all()


def test_what_hangs_so_and_is_none_stays() -> None:
    x, tets = with_one_more(2, 0.1)
    assert len(largest_piece(x, tets)) == len(tets)
