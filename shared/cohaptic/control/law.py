"""The local models that a client may run, and the one function that runs them.

A law turns a surface and a probe into the normal force on the hand. It has no clock, no log and no
clamp: limits are applied once, last, by the client's `safety.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from cohaptic.control.geometry import LocalSurface, depth
from cohaptic.control.predictive import predictive_force
from cohaptic.control.proportional import proportional_force, proportional_stiffness
from cohaptic.vec import Vec3


class Law(Enum):
    """Name of a local model."""

    PROPORTIONAL = "proportional"
    PREDICTIVE = "predictive"


@dataclass(frozen=True, slots=True)
class LocalForce:
    """What a law answers.

    Args:
        normal_force: On the hand along the surface's normal, never negative [N].
        felt_from_others: Its part that is there because others touch too [N].
        indentation: Of the surface under the probe, own force included [m].
    """

    normal_force: float
    felt_from_others: float
    indentation: float


NO_FORCE = LocalForce(0.0, 0.0, 0.0)


def local_force(law: Law, surface: LocalSurface, probe: Vec3, *, k_h: float) -> LocalForce:
    """Force of `law` for a probe at a local surface.

    Args:
        law: Local model.
        surface: Free of this client's own force.
        probe: Tip of the device in the world frame [m].
        k_h: Gain [N/m].
    """
    d_free = depth(surface, probe)
    # Where the probe would stand to the body if nobody else touched it.
    d_alone = d_free - surface.u_others
    if law is Law.PREDICTIVE:
        f = predictive_force(d_free, k_h=k_h)
        alone = predictive_force(d_alone, k_h=k_h)
    else:
        d = d_free - surface.c_ii * surface.own_force
        f = proportional_force(d, k_h=k_h)
        alone = max(0.0, proportional_stiffness(k_h=k_h, c_ii=surface.c_ii) * d_alone)
    return LocalForce(f, f - alone, surface.c_ii * f)
