"""What the world remembers between two ticks. Frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from cohaptic.control.delay import LoopDelay
from cohaptic.control.friction import Compliance3
from cohaptic.control.law import Gains, Law
from cohaptic.control.room_lag import RoomLag
from cohaptic.protocol.patch import Geometry
from cohaptic.vec import Vec3
from cohaptic_server.bodies.body import Response
from cohaptic_server.numeric import Floats
from cohaptic_server.world.contact import Contact
from cohaptic_server.world.displacement_field import Window
from cohaptic_server.world.loads import Press
from cohaptic_server.world.patch_geometry import Sight

# N; a force that is less is none. Behind a lag a force that was let go never quite ends.
NEGLIGIBLE = 1e-3


@dataclass(frozen=True, slots=True)
class Touch:
    """The newest that is known of one user.

    Args:
        user: Its number.
        law: Local model it runs.
        max_stiffness: Of its device [N/m].
        max_force: Of its device [N].
        damping_budget: What its passivity layer may damp [N s/m].
        probe: Tip [m].
        force: On the hand [N].
        seq: Of the sample; 0 before the first.
        tick: Of the patch that the sample was made with; 0 for none.
        t_client: Stamp of the sample, on the client's clock [s].
        arrived: When the sample came, on the server's clock [s].
        fresh: Whether samples still come; the force of a stale one is let go.
        fixed_gains: That the user chose itself, where the server allows it.
        geometry: Of the patches that it wants.
        friction: Whether its force may have a part along the surface.
    """

    user: int
    law: Law
    max_stiffness: float
    max_force: float
    probe: Vec3
    force: Vec3
    seq: int
    tick: int
    t_client: float
    arrived: float
    fresh: bool = True
    fixed_gains: Gains | None = None
    geometry: Geometry = Geometry.PLANE
    friction: bool = False
    damping_budget: float = 0.0


@dataclass(frozen=True, slots=True)
class UserState:
    """What the world remembers of a user between ticks.

    Args:
        touch: Its newest sample.
        contact: Where it was.
        presence: Share of its force that is let in, from 0 to 1.
        force: Normal force that the body carries, behind the room's lag [N].
        along: Force along the surface that it carries, shape (3,) [N]; None without friction.
        wanted: Normal force that it would carry without lag and limits [N].
        wanted_along: The same along the surface; None without friction.
        delay: Of its loop, as measured.
        velocity: Of its probe, smoothed, shape (3,) [m/s].
        surface: The free surface that its contact was found on; None before the first contact.
        free: Displacement without its own force; None until the tick is over.
        sight: What `free` is known of; None until the tick is over.
        compliance: Of the contact in all directions; None without friction or before the first
            tick is over.
        k_o_coupled: Coupling-aware stiffness, 1 / sum_j |C_ij| (science 3.2) [N/m].
    """

    touch: Touch
    contact: Contact
    presence: float
    force: float
    along: Floats | None = None
    wanted: float = 0.0
    wanted_along: Floats | None = None
    delay: LoopDelay = field(default_factory=LoopDelay)
    velocity: Floats = field(default_factory=lambda: np.zeros(3))
    surface: Window | None = None
    free: Window | None = None
    sight: Sight | None = None
    compliance: Compliance3 | None = None
    k_o_coupled: float = 0.0

    @property
    def carried(self) -> Floats:
        """Force on the hand that the body carries, its opposite, shape (3,) [N]."""
        force = self.force * self.contact.normal
        return force if self.along is None else np.asarray(force + self.along)

    @property
    def press(self) -> Press:
        """What the user does to the body."""
        return Press(self.contact, self.force, self.along)


@dataclass(frozen=True, slots=True)
class Release:
    """What is left of a contact whose probe is elsewhere all of a sudden: it fades where it was.

    Args:
        user: Whose it was.
        press: As it was when the probe left.
        share: Of it that the body still carries, 1 to 0.
    """

    user: int
    press: Press
    share: float

    def faded(self) -> Press:
        """The press that the body carries now."""
        along = None if self.press.along is None else self.share * self.press.along
        return Press(self.press.contact, self.share * self.press.force, along)


@dataclass(frozen=True, slots=True)
class WorldState:
    """The world between two ticks.

    Args:
        tick: Number of the last tick; 0 before the first.
        users: By number, in the order of the response's loads.
        response: Of the body at that tick.
        releases: Contacts that fade where their probes have left them.
        room: Lag of the room and what it comes from.
        coupling: C between the users, in their order, shape (n, n) [m/N].
    """

    tick: int = 0
    users: Mapping[int, UserState] = field(default_factory=lambda: MappingProxyType({}))
    response: Response | None = None
    releases: tuple[Release, ...] = ()
    room: RoomLag = field(default_factory=RoomLag)
    coupling: Floats = field(default_factory=lambda: np.zeros((0, 0)))
