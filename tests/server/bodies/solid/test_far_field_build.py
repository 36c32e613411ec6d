"""The compliance at every vertex, on shapes over which it varies by orders of magnitude."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.mesh.surface import pressure
from cohaptic_server.mesh.tetrahedra import TetMesh
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.testing.blocks import block
from cohaptic_server.testing.soft_ring import fixed, ring


@dataclass(frozen=True)
class Case:
    """A shape, and what of it is held."""

    mesh: Callable[[], TetMesh]
    fixed: Callable[[TetMesh], npt.NDArray[np.bool_]]
    settings: SolidSettings = field(default_factory=SolidSettings)


def plate() -> TetMesh:
    return block((0.2, 0.15, 0.003), (14, 11, 1))


def fin() -> TetMesh:
    """A block that becomes a fin of 3 mm towards its top."""
    mesh = block((0.1, 0.06, 0.1), (8, 4, 10))
    x = mesh.vertices.copy()
    x[:, 1] *= np.interp(x[:, 2], [0.0, 0.04, 0.06, 0.1], [1.0, 1.0, 0.05, 0.05])
    return TetMesh.checked(x, mesh.tets)


def noisy() -> TetMesh:
    mesh = block((0.1, 0.1, 0.08), (7, 7, 6))
    x = mesh.vertices + np.random.default_rng(2).normal(0.0, 0.0015, mesh.vertices.shape)
    return TetMesh.checked(x, mesh.tets)


def hollow() -> TetMesh:
    """A box with a cavity, its roof thin."""
    mesh = block((0.1, 0.1, 0.1), (8, 8, 8))
    middle = mesh.vertices[mesh.tets].mean(axis=1)
    inside = (np.abs(middle[:, :2]).max(axis=1) < 0.0375) & (abs(middle[:, 2] - 0.05) < 0.0375)
    used, tets = np.unique(mesh.tets[~inside], return_inverse=True)
    return TetMesh.checked(mesh.vertices[used], tets.reshape(-1, 4))


CASES = {
    "plate": Case(plate, lambda m: m.vertices[:, 0] < -0.0999),
    "rod": Case(lambda: block((0.3, 0.02, 0.02), (30, 2, 2)), lambda m: m.vertices[:, 0] < -0.1499),
    "fin": Case(fin, lambda m: m.vertices[:, 2] <= 0.0),
    "noisy box": Case(noisy, lambda m: m.vertices[:, 2] < 0.01),
    "hollow box": Case(hollow, lambda m: m.vertices[:, 2] <= 0.0, SolidSettings(order=1)),
    "ring": Case(lambda: ring(48, 24), fixed, SolidSettings(2e4, 0.4, order=1)),
    "tiny box": Case(
        lambda: block((0.006, 0.005, 0.005), (6, 5, 5)), lambda m: m.vertices[:, 2] <= 0.0
    ),
    "huge box": Case(
        lambda: block((4.0, 4.0, 4.0), (6, 6, 6)),
        lambda m: m.vertices[:, 2] <= 0.0,
        SolidSettings(young=1e12),
    ),
}


@functools.cache
def body(name: str) -> Solid:
    case = CASES[name]
    mesh = case.mesh()
    return Solid(mesh, case.fixed(mesh), case.settings)


def contact(solid: Solid, vertex: int) -> tuple[Ints, Floats]:
    """Vertices and weights of the press centred at a vertex."""
    mesh = solid.mesh
    return pressure(mesh, mesh.vertices[vertex], solid.contact_radius, mesh.normals[vertex])


def exact(solid: Solid, vertices: list[int]) -> Floats:
    """C_ii at some vertices, by a solver that shares nothing with the factor."""
    shape = solid.shape
    force = np.zeros((len(shape.nodes), 3, len(vertices)))
    for i, k in enumerate(vertices):
        under, weights = contact(solid, k)
        force[shape.surface[under], :, i] = weights[:, None] * solid.mesh.normals[k]
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    K = sp.csc_array(stiffness_of(shape)[dof][:, dof])
    loaded = force[free].reshape(-1, len(vertices))
    return np.asarray((loaded * spsolve(K, loaded)).sum(axis=0))


@pytest.mark.parametrize("name", CASES)
def test_the_table_is_exact_wherever_a_finger_presses(name: str) -> None:
    solid = body(name)
    free = np.flatnonzero(solid.shape.free_index >= 0)
    some = np.random.default_rng(5).permutation(free)[:10].tolist()
    table = solid.vertex_compliance()
    some += [int(table.argmax()), int(free[table[free].argmin()])]
    assert table[some] == pytest.approx(exact(solid, some), rel=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_a_contact_between_vertices_is_about_as_soft_as_they_are(name: str) -> None:
    """What a tick takes for C_ii while columns are missing: never half of the truth, below which
    a loop is unstable at a delay (science 3.3)."""
    solid = body(name)
    mesh, rng = solid.mesh, np.random.default_rng(6)
    errors: list[float] = []
    for face in rng.choice(len(mesh.faces), 30).tolist():
        corners, fraction = mesh.faces[face], rng.dirichlet([1.0, 1.0, 1.0])
        normal = fraction @ mesh.normals[corners]
        normal /= np.linalg.norm(normal)
        at = fraction @ mesh.vertices[corners]
        under, weights = pressure(mesh, at, solid.contact_radius, normal)
        if (solid.shape.free_index[under] < 0).any():
            continue
        force = (weights[:, None] * normal)[:, :, None]
        moved = solid.columns.respond(under, force).reshape(-1, 3)
        own = float(weights @ moved[under] @ normal)
        errors.append(solid.far_field.self_compliance(under, weights, normal) / own - 1.0)
    assert np.median(np.abs(errors)) < 0.06
    assert min(errors) > -0.35
