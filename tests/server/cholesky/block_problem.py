"""Matrices of 3x3 blocks of several fronts, for the tests of the factors."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from cohaptic_server.bodies.solid.parts import stiffness_of
from cohaptic_server.bodies.solid.shape import SolidSettings, shape_of
from cohaptic_server.cholesky.factor import Factor
from cohaptic_server.cholesky.symbolic import Analysis
from cohaptic_server.numeric import Floats, Ints, Mask
from cohaptic_server.testing.blocks import block


@functools.cache
def problem() -> tuple[sp.csr_array, Floats]:
    """Stiffness and positions of the free nodes."""
    mesh, settings = block((0.1, 0.1, 0.1), (7, 7, 7)), SolidSettings(order=1)
    shape = shape_of(mesh, mesh.vertices[:, 2] <= 0.0, settings)
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    return sp.csr_array(stiffness_of(shape)[dof][:, dof]), shape.nodes[free]


def on_surface(points: Floats) -> Mask:
    """Nodes on the sides and the top of the block."""
    return np.asarray((np.abs(points[:, :2]).max(axis=1) > 0.049) | (points[:, 2] > 0.099))


def grid(n: int) -> tuple[Ints, Floats]:
    """Cells of eight nodes and the positions of n^3 nodes on a grid."""
    number = np.arange(n**3).reshape(n, n, n)
    corners = [
        number[i : n - 1 + i, j : n - 1 + j, k : n - 1 + k].ravel()
        for i, j, k in np.ndindex(2, 2, 2)
    ]
    axes = np.meshgrid(*[np.arange(n, dtype=np.float64)] * 3, indexing="ij")
    return np.stack(corners, axis=1), np.stack([axis.ravel() for axis in axes], axis=1)


def shifted(elements: Ints, nodes: int, seed: int, least: float) -> Floats:
    """A random symmetric matrix on the pattern of the elements, its least eigenvalue given."""
    rng = np.random.default_rng(seed)
    K = np.zeros((3 * nodes, 3 * nodes))
    for element in elements:
        unknowns = (3 * element[:, None] + np.arange(3)).ravel()
        K[np.ix_(unknowns, unknowns)] += rng.normal(size=(len(unknowns), len(unknowns)))
    K = K + K.T
    return np.asarray(K + (least - np.linalg.eigvalsh(K)[0]) * np.eye(len(K)))


def blocks_of(analysis: Analysis, K: Floats) -> Floats:
    """The blocks of a dense matrix in the order of an analysis, shape (e, 9)."""
    n = len(analysis.order)
    columns = np.repeat(np.arange(n), np.diff(analysis.starts))
    by_node = K.reshape(n, 3, n, 3)
    order = analysis.order
    return by_node[order[analysis.rows], :, order[columns]].reshape(-1, 9)


def dense(analysis: Analysis, blocks: Floats) -> Floats:
    """The reverse of `blocks_of`."""
    n = len(analysis.order)
    columns = np.repeat(np.arange(n), np.diff(analysis.starts))
    row, column = analysis.order[analysis.rows], analysis.order[columns]
    K = np.zeros((n, 3, n, 3))
    K[row, :, column] = blocks.reshape(-1, 3, 3)
    K[column, :, row] = blocks.reshape(-1, 3, 3).swapaxes(1, 2)
    return K.reshape(3 * n, 3 * n)


def in_single(factor: Factor) -> Factor:
    """The same factor in single precision."""
    rounded = [
        replace(f, lower=f.lower.astype(np.float32), carry=f.carry.astype(np.float32))
        for f in factor.fronts
    ]
    return Factor(rounded, factor.front_of)
