"""Clamped plates that have no closed solution: a square one, and one as thick as a solid.

The square one is Mindlin's plate by Ritz' method, with polynomials of a degree beyond which nothing
changes; thin and pressed at a point it has Timoshenko's 0.00560 F b^2 / D. The round one is
elasticity in three dimensions without a theory of plates, in quadratic elements over its section:
beside it one sees what Mindlin's theory leaves out. A clamp also keeps the edge from getting
thicker and thinner, and the surfaces of a bent plate move by other amounts than its middle.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import legendre
from scipy.sparse.linalg import spsolve

from closed_forms import SHEAR, Hooke
from cohaptic_server.numeric import Floats, Ints

_TERMS = 15  # of each parity and direction; five more change 1.4e-5
_ACROSS, _THROUGH = 60, 4  # elements along the radius and the thickness; twice as many change 2e-4
_GRADING = 1.5  # elements are the smaller the nearer to the clamp
_POINTS = 12  # of Gauss' rule for the pressure within an element or along its radius


def square_plate(material: Hooke, half: float, thickness: float, contact: float) -> float:
    """Compliance of a clamped square plate under a fingertip in its middle [m/N] (Mindlin).

    Args:
        material: Material of the plate.
        half: Half of its side between the clamps [m].
        thickness: Thickness of the plate [m].
        contact: Radius of the pressure [m].
    """
    nu = material.nu
    D = material.young * thickness**3 / (12.0 * (1.0 - nu**2))
    S = SHEAR * material.shear * thickness * half**2
    # On [-1, 1], w is even in x and y; the turn about one axis is odd along the other one.
    x, weights = legendre.leggauss(4 * _TERMS)
    (e, de), (o, do) = _terms(x, 0), _terms(x, 1)

    def product(a: Floats, b: Floats) -> Floats:
        return np.asarray((a * weights) @ b.T)

    ee, bend, twist = product(e, e), product(do, e), product(o, de)
    stiff = D * np.kron(product(do, do), ee) + S * np.kron(product(o, o), ee)
    stiff += 0.5 * D * (1.0 - nu) * np.kron(product(o, o), product(de, de))
    beside = D * (nu * np.kron(bend, bend.T) + 0.5 * (1.0 - nu) * np.kron(twist, twist.T))
    across = S * np.kron(twist, ee)
    swap = np.arange(_TERMS**2).reshape(_TERMS, -1).T.ravel()  # x for y
    shear = S * (np.kron(product(de, de), ee) + np.kron(ee, product(de, de)))
    K = np.block(
        [
            [shear, across.T, across[swap][:, swap].T],
            [across, stiff, beside],
            [across[swap][:, swap], beside.T, stiff[swap][:, swap]],
        ]
    )
    f = np.zeros(len(K))
    f[: _TERMS**2] = _pressed(contact / half)
    return float(half**2 * f @ np.linalg.solve(K, f))


def _terms(x: Floats, odd: int) -> tuple[Floats, Floats]:
    """(1 - x^2) times Legendre's polynomials of a parity, and their derivatives, shape (k, n)."""
    table = np.zeros((_TERMS, 2 * _TERMS))
    table[np.arange(_TERMS), 2 * np.arange(_TERMS) + odd] = 1.0
    values, slopes = legendre.legval(x, table.T), legendre.legval(x, legendre.legder(table.T))
    clamped = 1.0 - x**2
    return np.asarray(clamped * values), np.asarray(clamped * slopes - 2.0 * x * values)


def _pressed(contact: float) -> Floats:
    """Mean of each product of terms in x and y under the pressure, shape (k k,)."""
    x, weights = legendre.leggauss(4 * _POINTS)
    r, angle = 0.5 * contact * (x + 1.0), 2.0 * math.pi * np.arange(4 * _POINTS) / (4 * _POINTS)
    fraction = weights * r * (1.0 - (r / contact) ** 2)
    at = r[:, None] * np.array([np.cos(angle), np.sin(angle)])[:, None, :]
    along, beside = (_terms(one.ravel(), 0)[0] for one in at)
    each = np.repeat(fraction / fraction.sum(), len(angle)) / len(angle)
    return np.asarray(((along * each) @ beside.T).ravel())


def round_solid(material: Hooke, radius: float, thickness: float, contact: float) -> float:
    """Compliance of a clamped round plate as a solid, the mean of its two sides [m/N].

    Args:
        material: Material of the plate.
        radius: Where nothing moves through the whole thickness [m].
        thickness: Thickness of the plate [m].
        contact: Radius of the pressure on the upper side [m].
    """
    r = radius * (1.0 - (1.0 - np.linspace(0.0, 1.0, 2 * _ACROSS + 1)[::2]) ** _GRADING)
    z = np.linspace(0.0, thickness, _THROUGH + 1)
    high = 2 * _THROUGH + 1
    nodes = np.arange((2 * _ACROSS + 1) * high).reshape(-1, high)
    rows, columns, values = list[Ints](), list[Ints](), list[Floats]()
    up, down = np.zeros(2 * nodes.size), np.zeros(2 * nodes.size)
    for i in range(_ACROSS):
        own, fractions = slice(2 * i, 2 * i + 3), _ring(r[i], r[i + 1], contact)
        up[2 * nodes[own, -1] + 1] += fractions
        down[2 * nodes[own, 0] + 1] += fractions
        for j in range(_THROUGH):
            k = _section(material, r[i], r[i + 1], z[j + 1] - z[j])
            some = nodes[own, 2 * j : 2 * j + 3].ravel()
            dof = np.stack([2 * some, 2 * some + 1], axis=1).ravel()
            rows.append(np.repeat(dof, 18))
            columns.append(np.tile(dof, 18))
            values.append(k.ravel())
    places = (np.concatenate(rows), np.concatenate(columns))
    K = sp.csc_array(sp.coo_array((np.concatenate(values), places)))
    held = np.zeros(len(up), dtype=np.bool_)
    held[2 * nodes[0]] = held[2 * nodes[-1]] = held[2 * nodes[-1] + 1] = True
    free = np.flatnonzero(~held)
    u = np.asarray(spsolve(K[free][:, free], up[free] / up.sum()))
    return float(0.5 * (up + down)[free] @ u / up.sum())


def _shapes(x: float) -> tuple[Floats, Floats]:
    """Quadratic shape functions on [-1, 1] and their derivatives, shape (3,)."""
    values = np.array([0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)])
    return values, np.array([x - 0.5, -2.0 * x, x + 0.5])


def _section(material: Hooke, start: float, end: float, high: float) -> Floats:
    """Stiffness of a ring of rectangular section, by radial and axial displacement, (18, 18)."""
    lame = material.young * material.nu / ((1.0 + material.nu) * (1.0 - 2.0 * material.nu))
    hooke = np.zeros((4, 4))  # strains: radial, hoop, axial, shear
    hooke[:3, :3] = lame + 2.0 * material.shear * np.eye(3)
    hooke[3, 3] = material.shear
    wide, K = end - start, np.zeros((18, 18))
    points, weights = legendre.leggauss(3)
    for p, a in zip(points, weights, strict=True):
        (nr, dr), r = _shapes(p), start + 0.5 * wide * (p + 1.0)
        for q, b in zip(points, weights, strict=True):
            nz, dz = _shapes(q)
            along, through = np.outer(dr, nz) * 2.0 / wide, np.outer(nr, dz) * 2.0 / high
            B = np.zeros((4, 18))
            B[0, ::2] = B[3, 1::2] = along.ravel()
            B[1, ::2] = np.outer(nr, nz).ravel() / r
            B[2, 1::2] = B[3, ::2] = through.ravel()
            K += 0.5 * math.pi * a * b * wide * high * r * B.T @ hooke @ B
    return K


def _ring(start: float, end: float, contact: float) -> Floats:
    """Share of the pressure on the three nodes of an element's side, but for a factor, (3,)."""
    fractions, pressed = np.zeros(3), max(0.0, min(end, contact) - start)
    for p, weight in zip(*legendre.leggauss(_POINTS), strict=True):
        r = start + 0.5 * pressed * (p + 1.0)
        profile = weight * pressed * r * (1.0 - (r / contact) ** 2)
        fractions += profile * _shapes(2.0 * (r - start) / (end - start) - 1.0)[0]
    return fractions
