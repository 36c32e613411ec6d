"""A water balloon, linearised about its inflated state.

Rubber membrane (`membrane.py`) unstretched at radius R / stretch, filled with incompressible water
to radius R. The inflated state solves dE/dx = p dV/dx at V = V0 on the mesh itself, so that the
tangent K = d2E/dx2 - p d2V/dx2 (in-plane elasticity, pretension, follower pressure) is symmetric
and every rigid motion of an unheld balloon is in its null space. Contacts then push on

    [ K  g ] [u]   [f]        g = dV/dx, exact volume to first order: g . u = 0
    [ g' 0 ] [q] = [0]

with u = 0 on the held base; C = K^-1 - K^-1 g g' K^-1 / (g' K^-1 g) over the free vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg

from cohaptic.errors import BodyError, SettingError
from cohaptic_server.bodies.balloon.membrane import Membrane
from cohaptic_server.bodies.body import DenseResponse, Load, Response
from cohaptic_server.bodies.damping import check_damping
from cohaptic_server.mesh.enclosed_volume import volume, volume_gradient, volume_hessian
from cohaptic_server.mesh.icosphere import icosphere
from cohaptic_server.mesh.rigid_motions import rigid_motions
from cohaptic_server.mesh.surface import SurfaceMesh
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, slots=True)
class BalloonSettings:
    """A balloon.

    Args:
        radius: Inflated [m].
        stretch: Inflated over unstretched radius.
        mu_h: Shear modulus times thickness of the unstretched rubber [N/m]; latex of 0.5 MPa and
            0.5 mm has 250.
        base: Vertices below this fraction of the radius under the centre are held.
        contact_radius: Of the pressure under a contact [m].
        subdivisions: Of the icosahedron; 3 gives 642 vertices.
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
            # Above this the dense compliance no longer fits a small machine.
            ("subdivisions", 1, 4),
        ):
            if not low <= getattr(self, name) <= high:
                raise SettingError(f"balloon {name}", getattr(self, name), f"from {low} to {high}")


@dataclass(frozen=True, eq=False)
class Inflated:
    """Equilibrium of membrane and water, nothing held.

    Args:
        x: Vertices, shape (n, 3) [m].
        faces: Shape (m, 3).
        pressure: Of the water [Pa].
        stiffness: Tangent K, sparse, shape (3 n, 3 n) [N/m].
        volume_gradient: g, shape (3 n,) [m^2].
    """

    x: Floats
    faces: Ints
    pressure: float
    stiffness: sp.csr_array
    volume_gradient: Floats


class Balloon:
    """The linear balloon behind the `Body` Protocol.

    Args:
        settings: The balloon.
        damping: B_o over K_o, for the simulation period that it is served with. With it the
            balloon is Kelvin-Voigt as in eq. (9), (K_o + B_o) x+ = f + B_o x; C stays that of the
            steady state.
    """

    name = "balloon"

    def __init__(self, settings: BalloonSettings | None = None, *, damping: float = 0.0) -> None:
        check_damping(damping)
        self.damping = damping
        self.settings = settings or BalloonSettings()
        self.inflated = inflate(self.settings)
        self._mesh = SurfaceMesh(self.inflated.x, self.inflated.faces)
        held = held_by_base(self.inflated, self.settings)
        self.compliance = _held_compliance(self.inflated, np.repeat(~held, 3))
        self.compliance.setflags(write=False)

    @property
    def mesh(self) -> SurfaceMesh:
        """The inflated surface."""
        return self._mesh

    @property
    def contact_radius(self) -> float:
        """Radius of the pressure under a contact [m]."""
        return self.settings.contact_radius

    def respond(self, loads: Sequence[Load], before: Response | None = None) -> DenseResponse:
        """Superposition of the Green's functions of what is touched; damping holds `before`."""
        n = len(self._mesh.vertices)
        fields = np.zeros((len(loads), n, 3))
        for i, load in enumerate(loads):
            dof = (3 * load.vertices[:, None] + np.arange(3)).ravel()
            share = (load.weights[:, None] * load.direction).ravel()  # (3 k,)
            # C is symmetric: its rows are its columns, and rows lie together in memory.
            fields[i] = (share @ self.compliance[dof]).reshape(n, 3)
        forces = np.array([load.force for load in loads])
        C = np.empty((len(loads), len(loads)))
        for i, load in enumerate(loads):
            C[i] = fields[:, load.vertices] @ load.direction @ load.weights
        displacement = np.tensordot(forces, fields, axes=1) if loads else np.zeros((n, 3))
        if self.damping == 0.0:
            return DenseResponse(displacement, fields, C, 0.5 * float(forces @ C @ forces))
        was = 0.0 if before is None else before.displacement
        x = np.asarray((displacement + self.damping * was) / (1.0 + self.damping))
        energy = 0.5 * float(x.ravel() @ (self.inflated.stiffness @ x.ravel()))
        # C of the steady state: the one within the tick is too stiff to be safe under delay.
        return DenseResponse(x, fields, C, energy)


def inflate(settings: BalloonSettings) -> Inflated:
    """Newton's method on the membrane and the volume together.

    Raises:
        BodyError: No equilibrium was reached.
    """
    x, faces = icosphere(settings.subdivisions, settings.radius)
    membrane = Membrane.at_rest(x / settings.stretch, faces, settings.mu_h)
    target = volume(x, faces)
    # Laplace: the sphere's pressure is the first guess.
    tension = settings.mu_h * (1.0 - settings.stretch**-6)
    p = 2.0 * tension / settings.radius
    for _ in range(20):
        g = volume_gradient(x, faces)
        K = membrane.hessian(x) - p * volume_hessian(x, faces)
        residual = membrane.gradient(x) - p * g
        lost = volume(x, faces) - target
        if (
            np.abs(residual).max() < 1e-10 * tension * settings.radius
            and abs(lost) < 1e-14 * target
        ):
            return Inflated(x, faces, p, sp.csr_array(K), g)
        # Rigid motions are free; one multiplier for each takes them out of the step.
        rigid = sp.csr_array(rigid_motions(x) / settings.radius)
        column = sp.csr_array(g[:, None])
        system = sp.block_array(
            [[K, -column, rigid], [-column.T, None, None], [rigid.T, None, None]]
        )
        solve = scipy.sparse.linalg.splu(sp.csc_array(system)).solve
        step = solve(np.concatenate([-residual, [lost], np.zeros(6)]))
        x = x + step[: x.size].reshape(x.shape)
        p = p + float(step[x.size])
    raise BodyError(f"the balloon found no equilibrium at stretch {settings.stretch}")


def held_by_base(balloon: Inflated, settings: BalloonSettings) -> npt.NDArray[np.bool_]:
    """Which vertices the base holds, shape (n,).

    Raises:
        BodyError: Too few.
    """
    held: npt.NDArray[np.bool_] = balloon.x[:, 2] < -settings.base * settings.radius
    if held.sum() < 3:
        raise BodyError(
            f"the base holds {held.sum()} vertices; fewer than 3 cannot keep the balloon from"
            " floating away"
        )
    return held


def _held_compliance(balloon: Inflated, free: npt.NDArray[np.bool_]) -> Floats:
    """C of the held balloon, zero at the base, shape (3 n, 3 n) [m/N]."""
    K: Floats = np.asarray(balloon.stiffness[free][:, free].toarray(), dtype=np.float64)
    g = balloon.volume_gradient[free]
    # Past its pressure maximum a balloon is stable only because the water cannot leave: K has one
    # negative mode, along g. On g . u = 0 the extra term changes nothing, and it makes K definite.
    K += np.outer(g, g) * (10.0 * np.diag(K).mean() / (g @ g))
    try:
        lower: Floats = np.asarray(scipy.linalg.cholesky(K, lower=True), dtype=np.float64)
    except scipy.linalg.LinAlgError as error:
        raise BodyError("the held balloon is not stable: its stiffness is indefinite") from error
    inverse: Floats = np.asarray(scipy.linalg.cho_solve((lower, True), np.eye(len(K))))
    Kg = inverse @ g
    C_free = inverse - np.outer(Kg, Kg) / (g @ Kg)
    C = np.zeros((free.size, free.size))
    C[np.ix_(free, free)] = 0.5 * (C_free + C_free.T)
    return C
