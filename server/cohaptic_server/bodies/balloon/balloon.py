"""A water balloon, linearised about its inflated state.

The rubber membrane (`membrane.py`) is unstretched at radius R / stretch, and incompressible water
fills it to radius R. The vertex positions x of the inflated balloon solve dE/dx = p dV/dx, with the
strain energy E of the rubber, the pressure p of the water, and its volume V = V0. The tangent
K = d2E/dx2 - p d2V/dx2 (in-plane elasticity, pretension, follower pressure) is therefore symmetric,
and every rigid motion of a balloon without a base is in its null space. Contact forces f then give
the displacement u, with a multiplier q for the volume:

    [ K  g ] [u]   [f]        g = dV/dx, exact volume to first order: g . u = 0
    [ g' 0 ] [q] = [0]

with u = 0 on the fixed base. The compliance matrix over the free vertices is
C = K^-1 - K^-1 g g' K^-1 / (g' K^-1 g).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
import scipy.sparse.linalg
from scipy.linalg import blas, lapack
from threadpoolctl import threadpool_limits

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.body import DenseResponse, Load, LoadArrays, Response
from cohaptic_server.bodies.green import Superposition
from cohaptic_server.bodies.superposition import COMPILED, seen_by, superpose
from cohaptic_server.bodies.viscous import check_damping
from cohaptic_server.mesh.enclosed_volume import volume, volume_gradient, volume_hessian
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.rigid_motions import rigid_motions
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints, Mask

Compliance = npt.NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class BalloonSettings:
    """Settings of a balloon.

    Args:
        radius: Inflated radius [m].
        stretch: Ratio of the inflated to the unstretched radius.
        mu_h: Shear modulus times thickness of the unstretched rubber [N/m]; latex of 0.5 MPa and
            0.5 mm has 250.
        base: Vertices more than this fraction of the radius below the centre are fixed.
        contact_radius: Radius of the pressure under a contact [m].
        subdivisions: Subdivisions of the icosahedron; 3 gives 642 vertices.
    """

    radius: float = 0.1
    stretch: float = 1.5
    mu_h: float = 250.0
    base: float = 0.85
    contact_radius: float = 0.02
    subdivisions: int = 3

    def __post_init__(self) -> None:
        for name, low, high in (
            ("radius", 0.005, 2.0),
            ("stretch", 1.05, 4.0),
            ("mu_h", 1.0, 1e5),
            ("base", 0.1, 0.98),
            ("contact_radius", 0.001, 0.5),
            # With more subdivisions the dense compliance would not fit a small machine.
            ("subdivisions", 1, 4),
        ):
            if not low <= getattr(self, name) <= high:
                raise SettingError(f"balloon {name}", getattr(self, name), f"from {low} to {high}")


@dataclass(frozen=True, eq=False)
class Inflated:
    """A balloon in equilibrium of membrane and water, with no vertex fixed.

    Args:
        x: Positions of the vertices, shape (n, 3) [m].
        faces: Vertices of each triangle, shape (m, 3).
        pressure: Pressure of the water [Pa].
        stiffness: Tangent K, sparse, shape (3 n, 3 n) [N/m].
        volume_gradient: g = dV/dx, shape (3 n,) [m^2].
    """

    x: Floats
    faces: Ints
    pressure: float
    stiffness: sp.csr_array
    volume_gradient: Floats


class Balloon:
    """The linear balloon, as a `Body`.

    Args:
        settings: Size, rubber and base; None takes the defaults.
        damping: Ratio B_o / K_o of damping to stiffness at the simulation period of the server. A
            damped balloon is Kelvin-Voigt as in eq. (9), (K_o + B_o) x+ = f + B_o x; its reported
            compliance stays that of the steady state.

    Attributes:
        mesh: The inflated surface.
        contact_radius: Radius of the pressure under a contact [m].
        linear: Whether the balloon has no damping.
        inflated: Equilibrium without contacts.
        compliance: Compliance matrix C of all vertices, zero at the base, in single precision,
            shape (3 n, 3 n) [m/N].
    """

    name = "balloon"

    def __init__(self, settings: BalloonSettings | None = None, *, damping: float = 0.0) -> None:
        check_damping(damping)
        self.damping, self.linear = damping, damping == 0.0
        self.settings = settings or BalloonSettings()
        self.inflated = inflate(self.settings)
        self.mesh = SurfaceMesh(self.inflated.x, self.inflated.faces)
        self.contact_radius = self.settings.contact_radius
        fixed = fixed_by_base(self.inflated, self.settings)
        self.compliance = _free_compliance(self.inflated, np.repeat(~fixed, 3))
        self.compliance.setflags(write=False)

    def green_source(self) -> Superposition | None:
        """Return the source of the Green's functions; None for a damped balloon."""
        return Superposition(self) if self.damping == 0.0 else None

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """Return the sum of the loads' fields; with damping it follows from `before` with a lag."""
        n, count = len(self.mesh.vertices), len(loads)
        starts, ends, vertices, weights, directions, forces = LoadArrays.of(loads)
        flat, C = np.empty((count, 3 * n)), np.empty((count, count))
        # C is symmetric: the rows serve as columns, and a row is contiguous in memory.
        if COMPILED:
            superpose(self.compliance, starts, ends, vertices, weights, directions, flat)
        else:
            for i, load in enumerate(loads):
                rows = self.compliance.reshape(n, 3, 3 * n)[load.vertices]
                flat[i] = np.einsum("k,a,kam->m", load.weights, load.direction, rows)
        seen_by(flat, starts, ends, vertices, weights, directions, C)
        displacement, fields = (forces @ flat).reshape(n, 3), flat.reshape(count, n, 3)
        if self.damping == 0.0:
            return DenseResponse(displacement, fields, C, 0.5 * float(forces @ C @ forces))
        previous = 0.0 if before is None else before.displacement
        x = np.asarray((displacement + self.damping * previous) / (1.0 + self.damping))
        energy = 0.5 * float(x.ravel() @ (self.inflated.stiffness @ x.ravel()))
        # C of the steady state: C of one tick would be unsafely small under delay (science 3.3).
        return DenseResponse(x, fields, C, energy)


def inflate(settings: BalloonSettings) -> Inflated:
    """Return the inflated balloon, computed by Newton's method for positions and pressure together.

    Raises:
        BodyError: Newton's method reached no equilibrium.
    """
    x, faces = icosphere(settings.subdivisions, settings.radius)
    membrane = Membrane.at_rest(x / settings.stretch, faces, settings.mu_h)
    target = volume(x, faces)
    # The first guess is the pressure in a sphere by Laplace's law.
    tension = settings.mu_h * (1.0 - settings.stretch**-6)
    p = 2.0 * tension / settings.radius
    for _ in range(20):
        g = volume_gradient(x, faces)
        K = membrane.hessian(x) - p * volume_hessian(x, faces)
        residual = membrane.gradient(x) - p * g
        excess = volume(x, faces) - target
        if (
            np.abs(residual).max() < 1e-10 * tension * settings.radius
            and abs(excess) < 1e-14 * target
        ):
            return Inflated(x, faces, p, sp.csr_array(K), g)
        # Rigid motions take no force; a multiplier for each keeps it out of the step.
        rigid = sp.csr_array(rigid_motions(x) / settings.radius)
        column = sp.csr_array(g[:, None])
        system = sp.block_array(
            [[K, -column, rigid], [-column.T, None, None], [rigid.T, None, None]]
        )
        solve = scipy.sparse.linalg.splu(sp.csc_array(system)).solve
        step = solve(np.concatenate([-residual, [excess], np.zeros(6)]))
        x = x + step[: x.size].reshape(x.shape)
        p = p + float(step[x.size])
    raise BodyError(f"the balloon found no equilibrium at stretch {settings.stretch}")


def fixed_by_base(balloon: Inflated, settings: BalloonSettings) -> Mask:
    """Return the mask of the vertices that the base fixes, shape (n,).

    Raises:
        BodyError: The base fixes fewer than three vertices.
    """
    fixed: Mask = balloon.x[:, 2] < -settings.base * settings.radius
    if fixed.sum() < 3:
        raise BodyError(
            f"the base holds {fixed.sum()} vertices; fewer than 3 cannot keep the balloon from"
            " floating away"
        )
    return fixed


def _free_compliance(balloon: Inflated, free: Mask) -> Compliance:
    """Return the compliance C of all vertices, zero at the base, symmetric, (3 n, 3 n) [m/N].

    This takes half of the time in which a server starts. It is kept short by LAPACK's inverse of a
    factor, which takes a third of the time of a solve for every unit force, and by steps that work
    on one triangle of the matrix only.
    """
    K: Floats = np.asarray(balloon.stiffness[free][:, free].toarray(), dtype=np.float64)
    g = balloon.volume_gradient[free]
    # Past its pressure maximum a balloon is stable only at constant volume: K has one negative
    # mode, along g. The added term makes K definite and has no effect on motions with g . u = 0.
    K += np.outer(g, g) * (10.0 * np.diag(K).mean() / (g @ g))
    # One thread: threads that wait for each other on busy cores took 3 s instead of 0.2 s.
    with threadpool_limits(limits=1):
        lower, info = lapack.dpotrf(K.T, lower=1, overwrite_a=1)
        if info != 0:
            raise BodyError("the held balloon is not stable: its stiffness is indefinite")
        inverse, _ = lapack.dpotri(lower, lower=1, overwrite_c=1)
        Kg: Floats = blas.dsymv(1.0, inverse, g, lower=1)
        half = blas.dsyr(-1.0 / (g @ Kg), Kg, lower=1, a=inverse, overwrite_a=1)
    half = half.astype(np.float32)
    C_free = np.tril(half)
    C_free += np.tril(half, -1).T
    # A slide reads a megabyte of C for each user and tick, which single precision halves. The
    # rounded C is exactly symmetric, and the body stays linear.
    C = np.zeros((free.size, free.size), dtype=np.float32)
    C[np.ix_(free, free)] = C_free
    return C
