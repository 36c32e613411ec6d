from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
import trimesh

from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.objects.surface import checks
from cohaptic_server.objects.surface.checks import count_intersecting
from cohaptic_server.objects.surface.surface_file import merge_vertices

MAKE: Any = trimesh.creation
Surface = tuple[Floats, Ints]


def of(mesh: Any) -> Surface:
    return np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)


def box(cuts: int = 2) -> Surface:
    mesh = MAKE.box()
    for _ in range(cuts):
        mesh = mesh.subdivide()
    return of(mesh)


def rounded(x: Floats, seed: int) -> Floats:
    """Turned, moved and written in single precision, as a file has it."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.asarray((x @ turn + rng.normal(size=3)).astype(np.float32), dtype=np.float64)


CLOSED: dict[str, Any] = {
    "box": lambda: box(3),
    "cylinder": lambda: of(MAKE.cylinder(0.5, 1.0, sections=64)),
    "washer": lambda: of(MAKE.annulus(0.3, 0.5, 0.1, sections=48)),
    "capsule": lambda: of(MAKE.capsule(1.0, 0.3)),
    "sheet": lambda: of(MAKE.box((1.0, 1.0, 1e-3)).subdivide().subdivide()),
}


@pytest.mark.parametrize("name", CLOSED)
def test_closed_surfaces_with_flat_parts_are_left_alone(name: str) -> None:
    x, faces = CLOSED[name]()
    for seed in range(3):
        assert count_intersecting(*merge_vertices(rounded(x, seed), faces)) == 0


@pytest.mark.parametrize("seed", range(3))
def test_a_wall_that_is_there_twice_is_found(seed: int) -> None:
    """Two boxes side by side: their walls cover each other, corner to corner or not."""
    x, faces = box()
    both = np.concatenate([faces, faces + len(x)])
    shifted = np.concatenate([x, x + np.array([1.0, 0.13, 0.07])])
    assert count_intersecting(rounded(shifted, seed), both) > 32
    apart = np.concatenate([x, x + np.array([1.001, 0.13, 0.07])])
    assert count_intersecting(rounded(apart, seed), both) == 0


@pytest.mark.parametrize("seed", range(3))
def test_a_triangle_folded_flat_on_its_neighbour_is_found(seed: int) -> None:
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.6, 0.8, 0.0]])
    folded, flat = np.array([[0, 1, 2], [1, 0, 3]]), x * np.array([1.0, -1.0, 1.0])
    assert count_intersecting(rounded(x, seed), folded) == 2
    unfolded = np.concatenate([x[:3], flat[3:]])
    assert count_intersecting(rounded(unfolded, seed), folded) == 0


def test_triangles_that_lie_on_each_other_are_not_all_compared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A damaged file of 30 kB has its triangle four thousand times: eight million pairs."""
    corner = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    count, compared = 2000, list[int]()
    overlap = checks._overlap  # pyright: ignore[reportPrivateUsage]

    def counted(a: Floats, b: Floats, out: float) -> Any:
        compared.append(len(a))
        return overlap(a, b, out)

    monkeypatch.setattr(checks, "_overlap", counted)
    assert count_intersecting(corner, np.tile([[0, 2, 1]], (count, 1))) == count
    assert sum(compared) < count**2 / 8


@pytest.mark.parametrize("seed", range(3))
def test_each_triangle_is_judged_as_in_pairs(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also small ones, where the large ones that they meet are known already."""
    rng, count = np.random.default_rng(seed), 60
    turns = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    corners = np.array([(1.0, 0.0, 0.0), (-0.5, 0.9, 0.0), (-0.5, -0.9, 0.0)]) @ turns
    corners[20:] = 0.1 * corners[20:] + rng.uniform(-1.0, 1.0, size=(count - 20, 1, 3))
    x = corners.reshape(-1, 3)
    faces = np.arange(3 * count).reshape(-1, 3)
    expected = np.zeros(count, dtype=np.bool_)
    for i, j in combinations(range(count), 2):
        if count_intersecting(x, faces[[i, j]]):
            expected[[i, j]] = True
    assert 0 < expected.sum() < count
    monkeypatch.setattr(checks, "_PAIRS", 10)  # so that there are many blocks
    assert (checks.intersecting(x, faces) == expected).all()
