"""The setting of a measurement: hands rest pressed into a body, and the first one acts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from cohaptic.simulated.delay_line import AT_ONCE, LinkSettings
from cohaptic.simulated.hand import Hand, HandScript
from cohaptic.vec import Vec3
from cohaptic_client.devices.device import DeviceInfo
from cohaptic_client.devices.simulated import INFO, SimulatedDevice
from cohaptic_client.loop.passivity import device_damping_limit
from cohaptic_experiments.transparency.motion import Probing, Wave
from cohaptic_experiments.transparency.product import Product, Variant
from cohaptic_experiments.transparency.scheme import AnyScheme, SchemeSession
from cohaptic_experiments.virtual_session import PERIOD
from cohaptic_server.bodies.body import Body
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.at_once import Motion, Mover, play_at_once

USUAL: Final = Hand()
# A tip that follows its intention whatever the force, as a rig does that measures a frequency
# response: 100 N/mm.
CLAMP = Hand(0.15, 1000.0, 1e5)
# s from joining to the first approach. A hand that touches within the first second meets its own
# fade-in, which is not measured here.
_JOINED = 2.5
_APPROACH = 0.5  # s
_REST = 1.0  # s of rest before the first hand acts


@dataclass(frozen=True, eq=False)
class Setting:
    """Hands on a body, and their link.

    Args:
        body: Touched body.
        users: Number of hands, evenly round the body; the second one is opposite the first, or
            next to opposite where their number is odd.
        hand: Mechanics of the hands.
        info: Device of every hand.
        link: Link of every user.
        late_ticks: Share of the server's ticks that come one or two periods late.
        depth: Depth at which the hands want to rest [m].
        apart: Time from the touch of one hand to that of the next [s]. Of hands that touch at the
            same instant nobody can tell what each wanted and what the others did to it, so that the
            server knows them later.
    """

    body: Body
    users: int = 2
    hand: Hand = USUAL
    info: DeviceInfo = INFO
    link: LinkSettings = AT_ONCE
    late_ticks: float = 0.0
    depth: float = 0.008
    apart: float = 0.7

    @property
    def rests_at(self) -> float:
        """Time at which all hands have come to rest, and the first one acts [s]."""
        last = _JOINED + (self.users - 1) * self.apart
        return last + _APPROACH + _REST + 6.0 * self.link.delay

    def angles(self) -> list[float]:
        """Return the place of each hand on the equator [rad]."""
        half = self.users // 2
        order = [0, half, *(i for i in range(1, self.users) if i != half)][: self.users]
        return [math.pi + 2.0 * math.pi * i / self.users for i in order]

    def intentions(self, sway: tuple[Wave, ...] = (), further: float = 0.0) -> list[Probing]:
        """Return the intention of each hand; the first one sways, or presses further [m]."""
        info, plans = describe(self.body), list[Probing]()
        for user, angle in enumerate(self.angles()):
            usual = HandScript(angle % (2.0 * math.pi)).intention(info.center, info.radius)
            plan = Probing(
                usual.surface, usual.direction, self.depth,
                approach_at=_JOINED + user * self.apart + 2.2 * self.link.delay,
                approach_time=_APPROACH,
            )  # fmt: skip
            acts = replace(plan, at_time=self.rests_at, sway=sway, further=further)
            plans.append(plan if user else acts)
        return plans

    def devices(self, plans: Sequence[Probing], *, clamped: bool) -> list[SimulatedDevice]:
        """Return the device of each hand; the first hand may be clamped to its intention."""
        rig = SimulatedDevice(CLAMP, plans[0], replace(INFO, max_force=math.inf))
        first = rig if clamped else SimulatedDevice(self.hand, plans[0], self.info)
        return [first, *(SimulatedDevice(self.hand, plan, self.info) for plan in plans[1:])]

    def product(self, variant: Variant) -> Product:
        """Return this program, with the stiffness and the damping that the devices render."""
        stiffness = self.info.max_stiffness
        budget = device_damping_limit(self.info.damping, stiffness, PERIOD)
        budget = min(budget, variant.budget)
        return Product(
            self.body, self.users, replace(variant, budget=budget, max_stiffness=stiffness)
        )

    def play(
        self, scheme: AnyScheme, plans: Sequence[Probing], seconds: float, *,
        clamped: bool = False,
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """Play a session; return tips, (n, 3, t) [m], and sizes of the forces, (n, t) [N]."""
        devices = self.devices(plans, clamped=clamped)
        return SchemeSession(scheme, devices, self.link, self.late_ticks).run(seconds)

    def truth(self, plans: Sequence[Probing], seconds: float, *, clamped: bool = False) -> Motion:
        """Play the same hands without a network."""
        devices = self.devices(plans, clamped=clamped)
        return play_at_once(self.body, [_mover(device) for device in devices], seconds)

    def without_network(self) -> Setting:
        """Return the same setting with a link that takes no time."""
        return replace(self, link=AT_ONCE, late_ticks=0.0)


def _mover(device: SimulatedDevice) -> Mover:
    def move(now: float, force: Vec3) -> Vec3:
        device.write(force)
        return device.read(now).position

    return move
