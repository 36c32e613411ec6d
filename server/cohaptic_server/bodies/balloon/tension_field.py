"""Relaxed energy of neo-Hookean rubber that wrinkles: a membrane that carries no compression.

A compressed thin sheet buckles at almost no force into wrinkles that are finer than any triangle.
The energy of `membrane.py`, without wrinkles, would resist compression; its tangent would be
indefinite there, and a mesh would crumple. The relaxed energy (Pipkin 1986, IMA J. Appl. Math. 36;
Steigmann 1990) assumes the wrinkles of least energy. With the squares c1 >= c2 of the principal
stretches, the shear modulus mu and the thickness h, the energy W per area of the unstretched sheet
is

    taut      c2^2 c1 > 1     W = mu h / 2 (c1 + c2 + 1 / (c1 c2) - 3)      as in `membrane.py`
    wrinkled  else, c1 > 1    W = mu h / 2 (c1 + 2 / sqrt(c1) - 3)          the width adjusts freely
    slack     else            W = 0

The relaxed energy is convex in the deformation gradient: its Hessian, which is exact here, has no
negative mode in any state, and only the pressure of the water can make a tangent indefinite. The
Hessian jumps where a triangle begins to wrinkle; energy and force are continuous.

The functions are loops over triangles, compiled where there is a compiler (`tension_field.pxd` has
the types); they do not check shapes. The strain of a triangle is a row of ten: cosine and sine of
the first principal axis in the unstretched sheet, the deformation gradient along both axes (three
numbers each), and the squares of the principal stretches, the larger one first.
"""

from __future__ import annotations

import math

from cohaptic_server.numeric import Floats, Ints


def strains(x: Floats, faces: Ints, gradients: Floats, out: Floats) -> None:
    """Compute the principal strains of all triangles.

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        faces: Vertices of each triangle, shape (m, 3).
        gradients: Gradients of the three shape functions in the unstretched sheet, shape (m, 3, 2)
            [1/m].
        out: Receives the strains, shape (m, 10).
    """
    for e in range(len(faces)):
        a, b, c = faces[e, 0], faces[e, 1], faces[e, 2]
        c11, c22, c12 = 0.0, 0.0, 0.0
        for i in range(3):
            one = (
                x[a, i] * gradients[e, 0, 0]
                + x[b, i] * gradients[e, 1, 0]
                + x[c, i] * gradients[e, 2, 0]
            )
            two = (
                x[a, i] * gradients[e, 0, 1]
                + x[b, i] * gradients[e, 1, 1]
                + x[c, i] * gradients[e, 2, 1]
            )
            out[e, 2 + i], out[e, 5 + i] = one, two
            c11 += one * one
            c22 += two * two
            c12 += one * two
        half = 0.5 * (c11 - c22)
        radius = math.sqrt(half * half + c12 * c12)
        cos, sin = 1.0, 0.0
        # Half of the angle of (half, c12), from the larger of cosine and sine. If both stretches
        # are equal, all axes are principal.
        if radius > 0.0 and half >= 0.0:
            cos = math.sqrt(0.5 * (1.0 + half / radius))
            sin = 0.5 * c12 / (radius * cos)
        elif radius > 0.0:
            sin = math.sqrt(0.5 * (1.0 - half / radius))
            cos = 0.5 * c12 / (radius * sin)
        for i in range(3):
            one, two = out[e, 2 + i], out[e, 5 + i]
            out[e, 2 + i], out[e, 5 + i] = cos * one + sin * two, cos * two - sin * one
        c1 = max(0.5 * (c11 + c22) + radius, 1e-30)
        out[e, 0], out[e, 1], out[e, 8] = cos, sin, c1
        # From the product, not the difference: accurate even if a triangle is nearly a line.
        out[e, 9] = max(c11 * c22 - c12 * c12, 0.0) / c1


def energy(strain: Floats, area: Floats) -> float:
    """Return the strain energy divided by mu h [m^2]: the sum of W / (mu h) times area.

    Args:
        strain: Strain of each triangle, shape (m, 10).
        area: Area of each unstretched triangle, shape (m,) [m^2].
    """
    total = 0.0
    for e in range(len(strain)):
        c1, c2 = strain[e, 8], strain[e, 9]
        if c1 * c2 * c2 > 1.0:
            total += area[e] * 0.5 * (c1 + c2 + 1.0 / (c1 * c2) - 3.0)
        elif c1 > 1.0:
            total += area[e] * 0.5 * (c1 + 2.0 / math.sqrt(c1) - 3.0)
    return total


def add_forces(
    strain: Floats, faces: Ints, gradients: Floats, stiffness: Floats, out: Floats
) -> None:
    """Add the nodal forces that hold the sheet in the given strain.

    Args:
        strain: Strain of each triangle, shape (m, 10).
        faces: Vertices of each triangle, shape (m, 3).
        gradients: As for `strains`, shape (m, 3, 2) [1/m].
        stiffness: Product mu h times area of each triangle, shape (m,) [N m].
        out: Receives the sum of the nodal forces, shape (n, 3) [N].
    """
    for e in range(len(faces)):
        c1, c2 = strain[e, 8], strain[e, 9]
        if c1 * c2 * c2 > 1.0:
            s1, s2 = 1.0 - 1.0 / (c1 * c1 * c2), 1.0 - 1.0 / (c1 * c2 * c2)
        elif c1 > 1.0:
            s1, s2 = 1.0 - 1.0 / (c1 * math.sqrt(c1)), 0.0
        else:
            continue
        cos, sin = strain[e, 0], strain[e, 1]
        for k in range(3):
            along = s1 * stiffness[e] * (cos * gradients[e, k, 0] + sin * gradients[e, k, 1])
            across = s2 * stiffness[e] * (cos * gradients[e, k, 1] - sin * gradients[e, k, 0])
            for i in range(3):
                out[faces[e, k], i] += along * strain[e, 2 + i] + across * strain[e, 5 + i]


# One function: a triangle takes only 0.1 us, and calls would take a noticeable part of this.
def add_tangents(
    strain: Floats,
    gradients: Floats,
    stiffness: Floats,
    index: Ints,
    beyond: int,
    scratch: Floats,
    blocks: Floats,
) -> None:
    """Add the Hessians of the triangles to the blocks of the tangent.

    Args:
        strain: Strain of each triangle, shape (m, 10).
        gradients: As for `strains`, shape (m, 3, 2) [1/m].
        stiffness: Product mu h times area of each triangle, shape (m,) [N m].
        index: Block of each pair of corners (a, b), b <= a; -1 - block if the block is transposed;
            `beyond` if a corner is fixed. Shape (m, 6).
        beyond: Number of blocks.
        scratch: Working memory, shape (6,).
        blocks: Blocks of the tangent, shape (beyond, 9) [N/m].
    """
    for e in range(len(strain)):
        c1, c2 = strain[e, 8], strain[e, 9]
        # Stress along and across; stress per strain along, across, between and in shear
        # (4 W_11, 4 W_22, 4 W_12, (S1 - S2) / (c1 - c2)).
        if c1 * c2 * c2 > 1.0:
            s1, s2 = 1.0 - 1.0 / (c1 * c1 * c2), 1.0 - 1.0 / (c1 * c2 * c2)
            shear = 1.0 / (c1 * c2 * c1 * c2)
            k11, k22, k12 = 4.0 * shear * c2 / c1, 4.0 * shear * c1 / c2, 2.0 * shear
        elif c1 > 1.0:
            s1, s2 = 1.0 - 1.0 / (c1 * math.sqrt(c1)), 0.0
            shear = s1 / (c1 - c2)
            k11, k22, k12 = 3.0 / (c1 * c1 * math.sqrt(c1)), 0.0, 0.0
        else:
            continue
        cos, sin = strain[e, 0], strain[e, 1]
        for k in range(3):
            scratch[2 * k] = cos * gradients[e, k, 0] + sin * gradients[e, k, 1]
            scratch[2 * k + 1] = cos * gradients[e, k, 1] - sin * gradients[e, k, 0]
        pair = 0
        for a in range(3):
            for b in range(a + 1):
                target = index[e, pair]
                pair += 1
                if target == beyond:
                    continue
                aa = stiffness[e] * scratch[2 * a] * scratch[2 * b]
                cc = stiffness[e] * scratch[2 * a + 1] * scratch[2 * b + 1]
                ac = stiffness[e] * scratch[2 * a] * scratch[2 * b + 1]
                ca = stiffness[e] * scratch[2 * a + 1] * scratch[2 * b]
                ff, gg = k11 * aa + shear * cc, k22 * cc + shear * aa
                fg, gf = k12 * ac + shear * ca, k12 * ca + shear * ac
                if target < 0:
                    # The transposed block differs only by an exchange of the two mixed terms.
                    target = -1 - target
                    fg, gf = gf, fg
                for i in range(3):
                    f, g = strain[e, 2 + i], strain[e, 5 + i]
                    one, two = ff * f + gf * g, fg * f + gg * g
                    for j in range(3):
                        blocks[target, 3 * i + j] += one * strain[e, 2 + j] + two * strain[e, 5 + j]
                    blocks[target, 4 * i] += s1 * aa + s2 * cc


def add_volume_gradient(x: Floats, faces: Ints, out: Floats) -> None:
    """Add the gradient dV/dx of the enclosed volume V to an array.

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        faces: Vertices of each triangle, shape (m, 3).
        out: Receives the sum, shape (n, 3) [m^2].
    """
    for e in range(len(faces)):
        for k in range(3):
            a, b, c = faces[e, k], faces[e, (k + 1) % 3], faces[e, (k + 2) % 3]
            out[a, 0] += (x[b, 1] * x[c, 2] - x[b, 2] * x[c, 1]) / 6.0
            out[a, 1] += (x[b, 2] * x[c, 0] - x[b, 0] * x[c, 2]) / 6.0
            out[a, 2] += (x[b, 0] * x[c, 1] - x[b, 1] * x[c, 0]) / 6.0


def add_pressure(
    x: Floats, faces: Ints, pressure: float, index: Ints, beyond: int, blocks: Floats
) -> None:
    """Add the stiffness of the water's pressure, -p d2V/dx2, to the blocks of the tangent.

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        faces: Vertices of each triangle, shape (m, 3).
        pressure: Pressure p of the water [Pa].
        index: As for `add_tangents`.
        beyond: As for `add_tangents`.
        blocks: As for `add_tangents`.
    """
    for e in range(len(faces)):
        # The block of d2V/dx2 between two corners is [v]x / 6, with v the position of the third
        # corner; the sign changes if the two corners are exchanged (enclosed_volume.py).
        for k in range(3):
            target = index[e, 1 + k if k < 1 else 2 + k]
            if target == beyond:
                continue
            third, sign = faces[e, 2 - k], -1.0 if k == 1 else 1.0
            if target < 0:
                target, sign = -1 - target, -sign
            scale = -sign * pressure / 6.0
            u, v, w = scale * x[third, 0], scale * x[third, 1], scale * x[third, 2]
            blocks[target, 1] -= w
            blocks[target, 2] += v
            blocks[target, 3] += w
            blocks[target, 5] -= u
            blocks[target, 6] -= v
            blocks[target, 7] += u
