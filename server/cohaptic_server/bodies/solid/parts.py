"""Computes the expensive parts of a solid once: its stiffness, the factor and the far field.

The stiffness is that of linear elastic tetrahedra with four or ten nodes: Hooke's law with Young's
modulus E, Poisson's ratio nu, and Lame's constants lambda = E nu / ((1 + nu)(1 - 2 nu)) and
mu = E / (2 (1 + nu)). With the shape functions N_a and H_ab = integral of grad N_a (x) grad N_b
over an element of volume V, the block between its nodes a and b is

    K_ab = lambda H_ab + mu H_ab' + mu tr(H_ab) 1.

The edges are straight, so grad N_a = sum_i D_ai g_i with D_ai = dN_a/dL_i and the constant
gradients g_i of the four barycentric coordinates L_i. Therefore H_ab = V sum_ij mean(D_ai D_bj)
g_i (x) g_j is exact without quadrature.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.solid.far_field import FarField, build_far_field
from cohaptic_server.bodies.solid.shape import Moduli, SolidSettings, SolidShape, shape_of
from cohaptic_server.cholesky.factor import Factor, FactorReader
from cohaptic_server.cholesky.factorise import factorise
from cohaptic_server.cholesky.plan import Plan, plan_of
from cohaptic_server.cholesky.symbolic import graph_of_elements
from cohaptic_server.mesh.tetrahedra import EDGES, TetMesh, gradients, volumes
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.process_memory import give_back
from cohaptic_server.progress import Progress


@dataclass(frozen=True, eq=False)
class SolidParts:
    """The prepared parts from which a `Solid` is built quickly.

    Args:
        shape: Nodes and surface.
        factor: Factor of the stiffness over the free nodes, or a reader of the stored factor.
        far_field: Compliance between samples of the surface.
    """

    shape: SolidShape
    factor: Factor | FactorReader
    far_field: FarField


class KeptFactor(Protocol):
    """Storage of a factor in double precision, in case the preparation is interrupted."""

    def load(self) -> Factor | None:
        """Return the stored factor; None if there is none."""
        ...

    def save(self, factor: Factor) -> None:
        """Store the factor."""
        ...


def plan_of_solid(shape: SolidShape, retained: Mask | None = None) -> Plan:
    """Plan the factorisation of a solid's stiffness, from the elements alone.

    Args:
        shape: Nodes and surface.
        retained: Nodes whose forces and displacements the factor can handle, shape (nodes,); None
            takes the nodes on the surface.
    """
    if retained is None:
        retained = _on_surface(shape)
    free = np.flatnonzero(~shape.fixed)
    index = np.full(len(shape.nodes), -1, dtype=np.int64)
    index[free] = np.arange(len(free))
    graph = graph_of_elements(index[shape.elements], len(free))
    return plan_of(graph, shape.nodes[free], retained[free])


def factor_of(
    shape: SolidShape,
    progress: Callable[[float], None] = lambda fraction: None,
    plan: Plan | None = None,
) -> Factor:
    """Factor the stiffness of a solid over the free nodes.

    Args:
        shape: Nodes, surface and material.
        progress: Receives the completed share, up to 1.
        plan: Result of `plan_of_solid`; None computes it.
    """
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    matrix = sp.csr_array(stiffness_of(shape)[dof][:, dof])
    points, retained = shape.nodes[free], _on_surface(shape)[free]
    plan = plan or plan_of_solid(shape)
    give_back()  # unused memory, since the estimate of memory counts the memory in use
    return factorise(matrix, points, retained, progress, plan)


def _on_surface(shape: SolidShape) -> Mask:
    on_surface = np.zeros(len(shape.nodes), dtype=np.bool_)
    on_surface[shape.surface] = True
    return on_surface


def stiffness_of(shape: SolidShape) -> sp.csr_array:
    """Return the stiffness over all nodes, with no node fixed, shape (3 nodes, 3 nodes) [N/m]."""
    return stiffness(shape.tets, shape.elements, len(shape.nodes), shape.moduli)


def make_parts(
    tets: TetMesh,
    fixed: Mask,
    settings: SolidSettings,
    progress: Progress = lambda phase, fraction: None,
    accept: Callable[[Plan], None] = lambda plan: None,
    factored: KeptFactor | None = None,
    moduli: Moduli | None = None,
) -> SolidParts:
    """Factor the stiffness and build the far field.

    Args:
        tets: The object at rest.
        fixed: Vertices that do not move, shape (n,).
        settings: Material, elements and contact radius.
        progress: Receives the phase and its completed share.
        accept: Called with the plan before factoring begins; may raise an error to prevent it.
        factored: Supplies the factor of an interrupted preparation, or stores a new factor.
        moduli: As for `shape_of`.

    Raises:
        BodyError: No vertices are fixed, too few, or all of them.
    """
    progress("factoring", 0.0)
    shape = shape_of(tets, fixed, settings, moduli)
    factor = None if factored is None else factored.load()
    if factor is None:
        plan = plan_of_solid(shape)
        accept(plan)
        factor = factor_of(shape, lambda fraction: progress("factoring", fraction), plan)
        if factored is not None:
            factored.save(factor)
    far_field = build_far_field(
        shape.mesh,
        shape.contact_radius,
        factor,
        shape.free_index,
        lambda fraction: progress("pressing", fraction),
    )
    return SolidParts(shape, factor, far_field)


_CHUNK = 4000  # elements assembled at once, each with 900 entries for ten nodes


def stiffness(mesh: TetMesh, elements: Ints, n: int, moduli: Moduli) -> sp.csr_array:
    """Return the stiffness of a solid with no node fixed, shape (3 n, 3 n) [N/m].

    Args:
        mesh: Corners of the tetrahedra.
        elements: Nodes of each tetrahedron, the corners first, shape (m, 4) or (m, 10).
        n: Number of nodes.
        moduli: Elastic moduli of each tetrahedron.
    """
    lame, mu = moduli.lame, moduli.mu
    means = _linear_means() if elements.shape[1] == 4 else _quadratic_means()
    total = sp.csr_array((3 * n, 3 * n))
    for start in range(0, len(elements), _CHUNK):
        part = slice(start, start + _CHUNK)
        tets, nodes = mesh.tets[part], elements[part]
        g = gradients(mesh.vertices, tets)
        V = volumes(mesh.vertices, tets)
        outer = np.einsum("m,mip,mjq->mijpq", V, g, g, optimize=True)
        H = np.einsum("abij,mijpq->mapbq", means, outer, optimize=True)
        trace = np.einsum("mapbp->mab", H)
        blocks = lame[part, None, None, None, None] * H
        blocks += mu[part, None, None, None, None] * np.swapaxes(H, 2, 4)
        blocks += np.einsum("m,mab,pq->mapbq", mu[part], trace, np.eye(3), optimize=True)
        total = total + _scatter(blocks, nodes, n)
    return sp.csr_array(total)


def _linear_means() -> Floats:
    """Return mean(D_ai D_bj) of the module's head for N_a = L_a, shape (4, 4, 4, 4)."""
    return np.asarray(np.einsum("ai,bj->abij", np.eye(4), np.eye(4)))


def _quadratic_means() -> Floats:
    """Return mean(D_ai D_bj) of the module's head for ten nodes, shape (10, 10, 4, 4).

    The shape functions are N_a = L_a (2 L_a - 1) and N_pq = 4 L_p L_q. D is linear in L,
    D_ai = c_ai0 + sum_k c_aik L_k. Over a tetrahedron the mean of L_k is 1/4, the mean of L_k L_l
    is 1/20, and the mean of L_k^2 is 1/10.
    """
    c = np.zeros((10, 4, 5))  # [node, barycentric gradient, 1 and L_0..3]
    for a in range(4):
        c[a, a, 0], c[a, a, 1 + a] = -1.0, 4.0
    for e, (p, q) in enumerate(EDGES):
        c[4 + e, p, 1 + q] = c[4 + e, q, 1 + p] = 4.0
    mean = np.full((5, 5), 0.05) + 0.05 * np.eye(5)
    mean[0, :] = mean[:, 0] = 0.25
    mean[0, 0] = 1.0
    return np.asarray(np.einsum("aik,kl,bjl->abij", c, mean, c, optimize=True))


def _scatter(blocks: Floats, nodes: Ints, n: int) -> sp.csr_array:
    """Return the sum of element blocks (m, a, 3, a, 3) as a sparse matrix (3 n, 3 n)."""
    # Indices of four bytes suffice for any matrix that fits into memory, and halve the memory.
    dof = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1).astype(np.int32)
    rows = np.repeat(dof, dof.shape[1], axis=1).ravel()
    columns = np.tile(dof, (1, dof.shape[1])).ravel()
    matrix = sp.coo_array((blocks.reshape(-1), (rows, columns)), shape=(3 * n, 3 * n))
    return sp.csr_array(matrix)
