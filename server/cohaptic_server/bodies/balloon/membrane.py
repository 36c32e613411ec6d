"""An incompressible neo-Hookean rubber membrane of triangles with constant strain.

The energy W per area of the unstretched sheet, of thickness h and shear modulus mu, depends on the
in-plane right Cauchy-Green tensor C = F^T F of the 3x2 deformation gradient F; the thickness of the
stretched sheet follows from incompressibility. With the second Piola-Kirchhoff stress S,

    W = mu h / 2 (tr C + 1 / det C - 3),   S = 2 dW/dC = mu h (I - C^-1 / det C).

Energy, gradient and Hessian are exact for the triangle, so at any stretch the Hessian is symmetric
and a rigid motion stores no energy. S includes the pretension of an inflated balloon.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from cohaptic_server.mesh.enclosed_volume import scatter_matrix, scatter_vector
from cohaptic_server.numeric import Floats, Ints


@dataclass(frozen=True, eq=False)
class Membrane:
    """A sheet in its unstretched state.

    Args:
        faces: Vertices of each triangle, shape (m, 3).
        rest_area: Area of each unstretched triangle, shape (m,) [m^2].
        gradients: Gradients of the three shape functions in the triangle's plane,
            shape (m, 3, 2) [1/m].
        mu_h: Shear modulus times thickness [N/m].
    """

    faces: Ints
    rest_area: Floats
    gradients: Floats
    mu_h: float

    @classmethod
    def at_rest(cls, x: Floats, faces: Ints, mu_h: float) -> Membrane:
        """Return the sheet that is unstretched at vertex positions `x`, shape (n, 3) [m]."""
        e1, e2 = x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]]
        length = np.linalg.norm(e1, axis=1)
        t1 = e1 / length[:, None]
        normal = np.cross(e1, e2)
        double_area = np.linalg.norm(normal, axis=1)
        t2 = np.cross(normal / double_area[:, None], t1)
        # The columns are the edges in the frame (t1, t2); the rows of the inverse are the gradients
        # of the second and third shape function.
        edges = np.zeros((len(faces), 2, 2))
        edges[:, 0, 0] = length
        edges[:, 0, 1] = np.einsum("mi,mi->m", e2, t1)
        edges[:, 1, 1] = np.einsum("mi,mi->m", e2, t2)
        gradients = np.empty((len(faces), 3, 2))
        gradients[:, 1:] = np.linalg.inv(edges)
        gradients[:, 0] = -gradients[:, 1] - gradients[:, 2]
        return cls(faces, 0.5 * double_area, gradients, mu_h)

    def energy(self, x: Floats) -> float:
        """Return the strain energy [J] of the sheet at vertex positions `x`, shape (n, 3) [m]."""
        C = self._strain(x)[1]
        trace = C[:, 0, 0] + C[:, 1, 1]
        density = 0.5 * self.mu_h * (trace + 1.0 / np.linalg.det(C) - 3.0)
        return float(self.rest_area @ density)

    def gradient(self, x: Floats) -> Floats:
        """Return the nodal forces dE/dx that hold the sheet at positions `x`, shape (3 n,) [N]."""
        F, C = self._strain(x)
        per_face = np.einsum(
            "m,mip,mpq,mkq->mki", self.rest_area, F, self._stress(C), self.gradients, optimize=True
        )
        return scatter_vector(per_face, self.faces, len(x))

    def hessian(self, x: Floats) -> sp.csr_array:
        """Return the tangent stiffness d2E/dx2 at positions `x`, shape (3 n, 3 n) [N/m]."""
        F, C = self._strain(x)
        g, area = self.gradients, self.rest_area
        inverse, det = np.linalg.inv(C), np.linalg.det(C)
        # Geometric part: the present stress rotates with the triangle.
        geometric = np.einsum("m,mkp,mpq,mlq->mkl", area, g, self._stress(C), g, optimize=True)
        # Material part: 2 dS/dC = 2 mu h / det C (C^-1 x C^-1 + C^-1 (.) C^-1), symmetrised.
        moduli = (2.0 * self.mu_h / det)[:, None, None, None, None] * (
            np.einsum("mij,mkl->mijkl", inverse, inverse)
            + 0.5 * np.einsum("mik,mjl->mijkl", inverse, inverse)
            + 0.5 * np.einsum("mil,mjk->mijkl", inverse, inverse)
        )
        # Strain per nodal displacement: sym(F^T (e_a (x) g_k)).
        half = np.einsum("mai,mkj->mkaij", F, g)
        B = 0.5 * (half + np.swapaxes(half, 3, 4))
        blocks = np.einsum("m,mkaij,mijpq,mlbpq->mkalb", area, B, moduli, B, optimize=True)
        blocks = blocks + np.einsum("mkl,ab->mkalb", geometric, np.eye(3))
        return scatter_matrix(blocks, self.faces, len(x))

    def _strain(self, x: Floats) -> tuple[Floats, Floats]:
        """Return the deformation gradient (m, 3, 2) and C = F^T F (m, 2, 2) of each triangle."""
        F = np.einsum("mki,mkp->mip", x[self.faces], self.gradients)
        return np.asarray(F), np.asarray(np.einsum("mip,miq->mpq", F, F))

    def _stress(self, C: Floats) -> Floats:
        """Return the second Piola-Kirchhoff stress times thickness, (m, 2, 2) [N/m]."""
        det = np.linalg.det(C)
        return np.asarray(self.mu_h * (np.eye(2) - np.linalg.inv(C) / det[:, None, None]))
