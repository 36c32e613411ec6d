"""This program as a scheme: the real room, frames and haptic loops, or parts of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from cohaptic.control.law import Law
from cohaptic.control.room_lag import RoomLag
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.simulated.hand import Hand, HandScript
from cohaptic.vec import Vec3
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_experiments.transparency.scheme import Arrived
from cohaptic_experiments.virtual_session import VirtualSession
from cohaptic_server.bodies.body import Body


@dataclass(frozen=True, slots=True)
class Variant:
    """How the program runs.

    Args:
        law: Law of every user.
        hz: Ticks per second.
        budget: Damping that each device may render [N s/m]; 0 switches the passivity layer off.
        max_stiffness: Stiffness that each device renders [N/m].
        lag: Lag of the room in place of the one that the server chooses [s]; None for the latter.
        layer: Whether the passivity layer acts; the server reckons with `budget` either way.
        models: Whether clients move models of the hands.
        pages: Hands of the last users, whose clients tell them, as the page does, and move none.
    """

    law: Law = Law.PREDICTIVE
    hz: float = 60.0
    budget: float = MAX_DAMPING
    max_stiffness: float = 2000.0
    lag: float | None = None
    layer: bool = True
    models: bool = False
    pages: tuple[Hand, ...] = ()


class Product:
    """This program.

    Args:
        body: Touched body.
        users: Number of users.
        variant: How the program runs.
    """

    def __init__(self, body: Body, users: int, variant: Variant | None = None) -> None:
        variant = variant or Variant()
        self._session = VirtualSession(body, variant.hz, now=0.0)
        self.room, self.period = self._session.room, 1.0 / variant.hz
        self._lag = variant.lag
        pages: list[Hand | None] = [None] * (users - len(variant.pages)) + [*variant.pages]
        self.users = [
            self._session.join(
                f"user {user}", HandScript(hand=page or Hand()), law=variant.law, geometry="mesh",
                max_damping=variant.budget, max_stiffness=variant.max_stiffness,
                models=variant.models and page is None and not variant.law.answers_own_dent,
                tells_hand=page is not None,
            )
            for user, page in enumerate(pages)
        ]  # fmt: skip
        if not variant.layer:
            for user in self.users:
                user.settings = replace(user.settings, max_damping=0.0)

    @property
    def lag(self) -> float:
        """Lag of the room [s]."""
        return self.room.world.room.lag

    def client(
        self, user: int, now: float, sample: DeviceSample, inbox: Sequence[bytes]
    ) -> tuple[Vec3, bytes | None]:
        """Compute one period of the real loop, as `Scheme.client`."""
        return self.users[user].client(now, sample, inbox)

    def server(
        self, now: float, inboxes: Mapping[int, Sequence[Arrived[bytes]]]
    ) -> Mapping[int, bytes]:
        """Compute one tick of the real room, as `Scheme.server`."""
        for user, came in inboxes.items():
            for at, frame in came:
                self.room.sample(self.users[user].number, ContactSample.decode(frame), at)
        if self._lag is not None:
            chosen = self.room.world.room
            fixed = RoomLag(self._lag, chosen.coupling, chosen.margin)
            self.room.world = replace(self.room.world, room=fixed)
        patches = self.room.tick(now)
        return {
            user: patches[client.number].encode()
            for user, client in enumerate(self.users)
            if client.number in patches
        }
