"""A solid by other means than the server's: strains, Gauss' rule, a finer pressure, SuperLU.

What it shares with the body is its discretisation alone: nodes, which of them belong to an element
and which are held, and that a pressure is spread over its surface as if that were linear between
neighbouring nodes. It is beside the body what a second program would be.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from cohaptic_server.bodies.solid.shape import SolidShape
from cohaptic_server.mesh.tetrahedra import EDGES
from cohaptic_server.numeric import Floats, Ints

# Four points, exact for polynomials of degree 2 (Hammer, Marlowe, Stroud 1956).
_NEAR, _FAR = 0.25 + 0.15 * 5.0**0.5, 0.25 - 0.05 * 5.0**0.5
_GAUSS = np.full((4, 4), _FAR) + (_NEAR - _FAR) * np.eye(4)
_PARTS = 10  # of each side of a face, for the pressure: the body has 3, or 1 on a fine surface
_STRAINS = np.array([[1, 1, 1, 0, 0, 0]] * 3 + [[0] * 6] * 3, dtype=np.float64)
_BATCH = 16  # presses solved for together


def stiffness(shape: SolidShape) -> sp.csc_array:
    """Stiffness of all nodes, none of them held: sum of B' C B, shape (3 n, 3 n) [N/m]."""
    corners, elements = shape.nodes[shape.elements[:, :4]], shape.elements
    frame = np.concatenate([np.ones((len(corners), 4, 1)), corners], axis=2)
    slopes = np.linalg.inv(frame)[:, 1:]  # of the barycentric coordinates, (m, 3, 4)
    volume = np.abs(np.linalg.det(frame)) / 6.0
    young, nu = shape.moduli.young, shape.moduli.nu
    shear = young / (2.0 * (1.0 + nu))
    hooke = (young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)))[:, None, None] * _STRAINS
    hooke = hooke + shear[:, None, None] * np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    count = elements.shape[1]
    K = np.zeros((len(elements), 3 * count, 3 * count))
    for place in _GAUSS:
        g = np.einsum("mij,aj->mai", slopes, _gradients(place, count))
        B = np.zeros((len(elements), 6, count, 3))
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
            B[:, i, :, i] = g[:, :, i]
            B[:, 3 + i, :, j], B[:, 3 + i, :, k] = g[:, :, k], g[:, :, j]
        flat = B.reshape(len(elements), 6, -1)
        K += 0.25 * volume[:, None, None] * (np.swapaxes(flat, 1, 2) @ hooke @ flat)
    dof = (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), -1)
    rows, columns = np.repeat(dof, dof.shape[1], axis=1), np.tile(dof, (1, dof.shape[1]))
    size = 3 * len(shape.nodes)
    return sp.csc_array(
        sp.coo_array((K.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
    )


def _gradients(place: Floats, count: int) -> Floats:
    """dN_a / dL_j at barycentric coordinates L, of N_a = L_a or L_a (2 L_a - 1) and 4 L_p L_q."""
    if count == 4:
        return np.eye(4)
    found = np.zeros((10, 4))
    found[:4] = np.diag(4.0 * place - 1.0)
    for k, (p, q) in enumerate(EDGES):
        found[4 + k, p], found[4 + k, q] = 4.0 * place[q], 4.0 * place[p]
    return found


def press(shape: SolidShape, vertex: int) -> Floats:
    """Share of each node in a fingertip's press along a vertex's normal, shape (nodes,).

    The pressure 1 - (r / radius)^2 on the finger's side of the surface; its share falls to nothing
    from faces at a right angle to the finger to those turned away by 120 degrees.
    """
    mesh, radius = shape.mesh, shape.contact_radius
    x = mesh.vertices[mesh.faces] - mesh.vertices[vertex]
    reach = np.linalg.norm(x - x.mean(axis=1)[:, None], axis=2).max(axis=1)
    near = np.flatnonzero(np.linalg.norm(x.mean(axis=1), axis=1) < radius + reach)
    x = x[near]
    area = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    size = np.linalg.norm(area, axis=1)
    facing = (area @ mesh.normals[vertex]) / np.maximum(size, 1e-300)
    side = np.clip(1.0 + 2.0 * facing, 0.0, 1.0) * size
    fractions = _middles()
    r = np.linalg.norm(np.einsum("qc,fci->fqi", fractions, x), axis=2)
    pressure = side[:, None] * np.maximum(0.0, 1.0 - (r / radius) ** 2)
    total = np.zeros(len(shape.nodes))
    np.add.at(total, shape.surface[mesh.faces[near]], pressure @ fractions)
    return np.asarray(total / total.sum())


def _middles() -> Floats:
    """Barycentric coordinates of the middles of equal parts of a triangle, shape (parts^2, 3)."""
    n, found = _PARTS, list[tuple[float, float, float]]()
    for i in range(n):
        for j in range(n - i):
            found.append((i + 1 / 3, j + 1 / 3, n - i - j - 2 / 3))
            if i + j < n - 1:
                found.append((i + 2 / 3, j + 2 / 3, n - i - j - 4 / 3))
    return np.array(found) / n


def vertex_compliance(shape: SolidShape, vertices: Ints) -> Floats:
    """C_ii of a contact centred at some vertices, along their normals, shape (k,) [m/N]."""
    free = np.flatnonzero(~shape.fixed)
    dof = (3 * free[:, None] + np.arange(3)).ravel()
    K = sp.csc_array(stiffness(shape)[dof][:, dof])
    options = {"SymmetricMode": True}
    lu = splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    out = np.empty(len(vertices))
    for start in range(0, len(vertices), _BATCH):
        batch = vertices[start : start + _BATCH]
        fractions = np.stack([press(shape, k) for k in batch.tolist()], axis=1)[free]
        loaded = fractions[:, None] * shape.mesh.normals[batch].T
        loaded = loaded.reshape(-1, len(batch))
        out[start : start + len(batch)] = (loaded * lu.solve(loaded)).sum(axis=0)
    return out
