"""The laws of an elastic body as one check, for the bodies of this package and for others.

    check_body(MyBody())              # a linear body: displacements add up
    check_body(MyRubber(), linear=False)

The laws are the functions of `body_laws.py`; an error names the broken one.
"""

from __future__ import annotations

import numpy as np

from cohaptic_server.bodies.body import Body
from cohaptic_server.testing.body_laws import LAWS, LINEAR_LAWS, Subject
from cohaptic_server.testing.contacts import pressed, soft_contacts

_CONTACTS = 3
_DENT = 0.15  # depth of a press over the contact radius: past small strains of a nonlinear body


class BrokenLawError(AssertionError):
    """A body breaks a law.

    Args:
        law: Name of the law.
        reason: The observation.
    """

    def __init__(self, law: str, reason: object) -> None:
        super().__init__(f"{law}: {reason}")
        self.law = law


def check_body(body: Body, *, linear: bool = True) -> None:
    """Check the laws of an elastic body.

    Args:
        body: Any implementation of the `Body` Protocol, also a viscous one.
        linear: Whether displacements under several loads add up.

    Raises:
        BrokenLawError: The body breaks a law.
    """
    at_rest = soft_contacts(body, _CONTACTS)
    C = body.respond(at_rest).compliance
    own = np.diag(C)
    if not (np.isfinite(C).all() and (own > 0.0).all()):
        raise BrokenLawError("own_force_dents_inward", f"C_ii is {own.tolist()} at rest")
    forces = _DENT * body.contact_radius / own * np.linspace(0.6, 1.0, len(own))
    scale = float((np.abs(C) @ forces).max())
    subject = Subject(body, linear, pressed(at_rest, forces), forces, scale)
    for law in LAWS if linear else (law for law in LAWS if law not in LINEAR_LAWS):
        try:
            law(subject)
        except BrokenLawError:
            raise
        except AssertionError as error:
            raise BrokenLawError(law.__name__, error) from error
