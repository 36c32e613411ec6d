from __future__ import annotations

import itertools
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.protocol.scene_surface import Surface
from cohaptic.protocol.traversal import Traversal
from cohaptic_server.bodies.spring import plate
from cohaptic_server.mesh.icosphere import icosphere

Faces = list[tuple[int, int, int]]


def plainly(n: int, faces: Faces) -> list[tuple[int, ...]]:
    """Vertex, p, q, r as the protocol's page says it, without any haste."""
    neighbours: list[set[int]] = [set() for _ in range(n)]
    across: dict[frozenset[int], list[tuple[int, int]]] = {}
    for k, face in enumerate(faces):
        for v, a, b in itertools.permutations(face):
            neighbours[v].add(a)
            if a < b:
                across.setdefault(frozenset((a, b)), []).append((k, v))
    place: dict[int, int] = {}
    for start in range(n):
        queue = deque([start] if start not in place else [])
        place.setdefault(start, len(place))
        while queue:
            for w in sorted(neighbours[queue.popleft()]):
                if w not in place:
                    place[w] = len(place)
                    queue.append(w)
    found: list[tuple[int, ...]] = []
    for v in sorted(place, key=lambda v: place[v]):
        best: list[tuple[int, ...]] = []
        for corners, sides in across.items():
            if len(sides) != 2 or v not in (sides[0][1], sides[1][1]):
                continue
            (_, one), (_, two) = sides
            r = two if one == v else one
            p, q = sorted(corners, key=lambda w: place[w])
            if place[r] < place[v] and place[q] < place[v]:
                best.append((place[r], place[p], place[q], p, q, r))
        if best:
            found.append((v, *min(best)[3:]))
            continue
        first = min((place[w], w) for w in (*neighbours[v], v))[1]
        found.append((v, *(3 * [first] if first != v else 3 * [n])))
    return found


corner = st.integers(0, 9)
triangle = st.tuples(corner, corner, corner).filter(lambda face: len(set(face)) == 3)


@given(st.lists(triangle, max_size=16, unique_by=frozenset))
def test_it_is_as_documented_for_any_triangles(faces: Faces) -> None:
    t = Traversal.of(10, faces)
    assert list(zip(*(a.tolist() for a in (t.order, t.p, t.q, t.r)), strict=True)) == plainly(
        10, faces
    )


def test_a_smooth_surface_becomes_small_whatever_the_order_of_its_vertices() -> None:
    x, faces = icosphere(3, 0.1)
    u = 0.02 * np.exp(-((x - [0.1, 0.0, 0.0]) ** 2).sum(axis=1) / 0.05**2)[:, None] * x / 0.1
    shuffle = np.random.default_rng(1).permutation(len(x))
    other = np.empty_like(shuffle)
    other[shuffle] = np.arange(len(x))
    straight = len(Surface.of(u).encode(Traversal.of(len(x), faces)))
    shuffled = len(Surface.of(u[shuffle]).encode(Traversal.of(len(x), other[faces])))
    assert straight < 2.0 * len(x)
    assert shuffled < 2.0 * len(x)


@pytest.mark.parametrize("level", [0, 2])
def test_a_plane_in_motion_costs_almost_nothing(level: int) -> None:
    """The parallelogram is exact for any linear field, up to rounding."""
    x, faces = plate(0.2, 20)
    gradient = np.random.default_rng(level).normal(size=(3, 3))
    units = np.rint(2000 * x @ gradient).astype(np.int16)
    there = Traversal.of(len(x), faces)
    padded = np.concatenate([units, np.zeros((1, 3), np.int16)])
    left = units[there.order] - (padded[there.p] + padded[there.q] - padded[there.r])
    # Two of the first row have only a neighbour; a rounding error each of four numbers.
    assert np.median(np.abs(left)) <= 1
    assert (np.abs(left) > 2).mean() < 0.1
