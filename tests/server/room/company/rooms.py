"""A room whose pages hear of each other, without a socket or a clock."""

from __future__ import annotations

from typing import Any

from cohaptic.protocol.control.company import Aim, Company, Follow, Point, Present
from cohaptic.protocol.messages import Hello, encode_control
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from cohaptic.protocol.watch_messages import Watch, decode_watch_control
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.guard.limits import Limits
from cohaptic_server.guard.sources import Sources
from cohaptic_server.room.company.shared_views import REPORT_EVERY
from cohaptic_server.room.peer import Peer
from cohaptic_server.room.room import Room
from cohaptic_server.room.session_host import SessionHost
from cohaptic_server.room.session_setup import RoomAdmission
from cohaptic_server.room.watch.scene_broadcast import SceneBroadcast
from cohaptic_server.settings import ServerSettings

AIM = Aim(azimuth=1.0, elevation=0.25, distance=4.0)


def key_of(name: str) -> str:
    return f"secret of {name:*<8}".replace(" ", "_")


class Played:
    """A session host with the time that has passed there.

    Attributes:
        now: Time [s].
    """

    def __init__(self, body: Balloon, limits: Limits | None = None, **settings: Any) -> None:
        room = Room(body, ServerSettings(**settings))
        room_admission = RoomAdmission(Sources(limits or Limits()))
        self.session_host = SessionHost(room, SceneBroadcast(room, model=None), room_admission)
        self.now = 0.0

    def say(self, peer: Peer, message: Any) -> None:
        text = message if isinstance(message, str) else encode_control(message)
        self.session_host.receive(peer, text, self.now, 0.0)

    def connect(self, first: Hello | Watch, source: str = "10.0.0.1") -> Peer:
        peer = self.session_host.connect(self.now, SUBPROTOCOL, SUBPROTOCOL, source)
        self.say(peer, first)
        return peer

    def hand(self, name: str) -> Peer:
        """One who touches, with a secret."""
        return self.connect(Hello(protocol=PROTOCOL_VERSION, name=name, key=key_of(name)))

    def page(self, *, company: bool = True, source: str = "10.0.0.1") -> Peer:
        """A page that watches."""
        return self.connect(Watch(protocol=PROTOCOL_VERSION, company=company), source)

    def person(self, name: str, *, open_view: bool = True) -> tuple[Peer, Peer]:
        """A hand and the page that it belongs to."""
        hand, page = self.hand(name), self.page()
        said = Present(name=name, user=hand.user, key=key_of(name), open=open_view)
        self.say(page, said)
        return hand, page

    def follow(self, page: Peer, user: int | None) -> None:
        self.say(page, Follow(user=user))

    def aim(self, page: Peer, azimuth: float = 1.0) -> None:
        self.say(page, AIM.model_copy(update={"azimuth": azimuth}))

    def point(self, page: Peer) -> None:
        self.say(page, Point(point=(0.1, 0.0, 0.0)))

    def step(self, seconds: float = REPORT_EVERY) -> None:
        self.now += seconds
        self.session_host.shared_views.step(self.now)

    def leave(self, peer: Peer) -> None:
        self.session_host.disconnect(peer, "bye")


def heard(peer: Peer) -> list[Any]:
    """What a page is told, in order."""
    waiting = peer.session.take(clear=True)
    return [decode_watch_control(data) for data in waiting if isinstance(data, str)]


def company_of(peer: Peer) -> Company:
    """The newest that a page is told of who is here."""
    return [news for news in heard(peer) if isinstance(news, Company)][-1]
