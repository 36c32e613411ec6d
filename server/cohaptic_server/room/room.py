"""Who is in, and what they do to the body. A state machine without I/O.

Presence (samples) is state: each user writes only its own, the newest replaces the last, and
silence removes it. Joining and leaving are events.
"""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass, replace

from cohaptic.control.law import Gains
from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import (
    BodyInfo,
    FixedGains,
    Hello,
    SetLaw,
    UserJoined,
    UserLeft,
    Welcome,
)
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.rest_mesh import MAX_FACES, MAX_VERTICES, RestMesh
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.numeric import Floats, Ints
from cohaptic_server.settings import ServerSettings
from cohaptic_server.world.state import Touch, WorldState
from cohaptic_server.world.tick import advance

STALE_AFTER = 0.5  # s without a sample: the user's force is let go until the next one
REPLACE_AFTER = 2.0  # s without a sample: another client may take the name over


@dataclass(frozen=True, slots=True)
class Member:
    """A user in the room.

    Args:
        user: Its number; never used twice.
        hello: What it said when it came, and changed since.
        touch: Newest sample; None before the first.
        heard: When it was last heard of [s].
    """

    user: int
    hello: Hello
    touch: Touch | None
    heard: float


class Room:
    """The users of one body.

    Attributes:
        world: After the last tick.
        members: Who is in, by number.
        patches: Of the last tick, by user.
    """

    def __init__(self, body: Body, settings: ServerSettings) -> None:
        self.body = body
        self.touched_body = TouchedBody(body)
        self.settings = settings
        self.world = WorldState()
        self.members: dict[int, Member] = {}
        self.patches: dict[int, Patch] = {}
        self._next_user = 1
        self._rest_mesh: bytes | None = None
        self._touch_mesh: bytes | None = None

    def join(self, hello: Hello, now: float) -> tuple[Welcome, UserJoined, int | None]:
        """Take a user in.

        Returns:
            Its welcome, the news for the others, and the number of a silent user of the same name
            whose place it takes, if any; the caller ends that one's session.

        Raises:
            RemoteProtocolError: The name is in use, the room is full, or the body cannot be had as
                the client wants it.
        """
        holder = next((m for m in self.members.values() if m.hello.name == hello.name), None)
        self._check_gains(hello.fixed_gains)
        self._check_geometry(hello.geometry)
        if holder is not None and now - holder.heard < REPLACE_AFTER:
            names = ", ".join(sorted(m.hello.name for m in self.members.values()))
            raise RemoteProtocolError(
                "name", hello.name, f"one that is free (taken: {names})", CloseCode.NAME_TAKEN
            )
        if holder is None and len(self.members) >= self.settings.max_users:
            limit = f"at most {self.settings.max_users}"
            raise RemoteProtocolError(
                "number of users", len(self.members) + 1, limit, CloseCode.ROOM_FULL
            )
        if holder is not None:
            self.leave(holder.user)
        user = self._next_user
        self._next_user += 1
        present = tuple(m.hello.name for m in self.members.values())
        self.members[user] = Member(user, hello, None, now)
        welcome = Welcome(
            user=user,
            name=hello.name,
            simulation_period=self.settings.simulation_period,
            body=describe(self.body),
            users=present,
        )
        return welcome, UserJoined(user=user, name=hello.name), holder.user if holder else None

    def sample(self, user: int, sample: ContactSample, now: float) -> None:
        """Keep the newest sample of a user."""
        member = self.members[user]
        touch = Touch(
            user=user,
            law=member.hello.law,
            max_stiffness=member.hello.max_stiffness,
            max_force=member.hello.max_force,
            damping_budget=member.hello.damping_budget,
            probe=sample.probe,
            force=sample.force,
            seq=sample.seq,
            tick=sample.tick,
            t_client=sample.t_client,
            arrived=now,
            fixed_gains=_gains(member.hello.fixed_gains),
            geometry=Geometry[member.hello.geometry.upper()],
            friction=member.hello.friction,
        )
        self.members[user] = replace(member, touch=touch, heard=now)

    def set_law(self, user: int, change: SetLaw) -> None:
        """A user changes its local model.

        Raises:
            RemoteProtocolError: It asks for gains that this server does not let it choose.
        """
        self._check_gains(change.fixed_gains)
        member = self.members[user]
        hello = member.hello.model_copy(
            update={"law": change.law, "fixed_gains": change.fixed_gains}
        )
        touch = member.touch and replace(
            member.touch, law=change.law, fixed_gains=_gains(change.fixed_gains)
        )
        self.members[user] = replace(member, hello=hello, touch=touch)

    def _check_gains(self, gains: FixedGains | None) -> None:
        if gains is not None and not self.settings.allow_fixed_gains:
            raise RemoteProtocolError(
                "fixed_gains",
                f"{gains.k_h:g} N/m",
                "none: start the server with --allow-fixed-gains to choose gains yourself",
            )

    def _check_geometry(self, geometry: str) -> None:
        if geometry == "mesh" and not self.has_touch_mesh:
            touched = self.touched_body.mesh
            limit = f"plane or sphere: {_too_large(touched.vertices, touched.faces)}"
            raise RemoteProtocolError("geometry", geometry, limit)

    def check_watchable(self) -> None:
        """Raise RemoteProtocolError if the body is too large to be shown."""
        if not self.has_rest_mesh:
            why = _too_large(self.body.mesh.vertices, self.body.mesh.faces)
            raise RemoteProtocolError("message", "Watch", f"Hello alone: {why}")

    @property
    def has_rest_mesh(self) -> bool:
        """Whether the body is small enough to be shown."""
        return _fits(self.body.mesh.vertices, self.body.mesh.faces)

    @property
    def has_touch_mesh(self) -> bool:
        """Whether the body is small enough for mesh patches."""
        touched = self.touched_body.mesh
        return _fits(touched.vertices, touched.faces)

    def rest_mesh(self) -> bytes:
        """The frame of the resting mesh, for one who watches; made once."""
        if self._rest_mesh is None:
            mesh = self.body.mesh
            self._rest_mesh = _mesh_frame(mesh.vertices, mesh.faces)
        return self._rest_mesh

    def touch_mesh(self) -> bytes:
        """The frame of the mesh that is touched, for a user of mesh patches; made once.

        With it everything is made that mesh patches need, since a tick has no time for that.
        """
        if self._touch_mesh is None:
            _ = self.touched_body.vertex_compliance
            touched = self.touched_body.mesh
            self._touch_mesh = _mesh_frame(touched.points, touched.faces)
        return self._touch_mesh

    def leave(self, user: int, reason: str = "left") -> UserLeft | None:
        """A user is gone; its force fades in the world. None if it was not in."""
        member = self.members.pop(user, None)
        if member is None:
            return None
        return UserLeft(user=user, name=member.hello.name, reason=reason)

    def tick(self, now: float) -> dict[int, Patch]:
        """Advance the world by one period; the patch of each user by number.

        A user whose samples stopped still gets patches, without force: it may be alive and
        listening behind a stalled uplink.
        """
        touches = [
            touch if now - member.heard <= STALE_AFTER else replace(touch, fresh=False)
            for member in self.members.values()
            if (touch := member.touch) is not None
        ]
        dt = self.settings.simulation_period
        self.world, self.patches = advance(self.touched_body, self.world, touches, now=now, dt=dt)
        return self.patches


def _gains(fixed: FixedGains | None) -> Gains | None:
    return None if fixed is None else Gains(fixed.k_h, fixed.integral_gain)


def describe(body: Body) -> BodyInfo:
    """What the welcome says of a body: its bounding sphere about the middle of its box."""
    x = body.mesh.vertices
    center = 0.5 * (x.min(axis=0) + x.max(axis=0))
    radius = float(((x - center) ** 2).sum(axis=1).max() ** 0.5)
    where = (float(center[0]), float(center[1]), float(center[2]))
    return BodyInfo(name=body.name, center=where, radius=radius, contact_radius=body.contact_radius)


def _fits(vertices: Sized, faces: Sized) -> bool:
    return len(vertices) <= MAX_VERTICES and len(faces) <= MAX_FACES


def _too_large(vertices: Sized, faces: Sized) -> str:
    return (
        f"the body has {len(vertices)} vertices and {len(faces)} faces,"
        f" a frame can number {MAX_VERTICES} and {MAX_FACES}"
    )


def _mesh_frame(vertices: Floats, faces: Ints) -> bytes:
    """A mesh as the wire carries it."""
    x, corners = vertices.tolist(), faces.tolist()
    mesh = RestMesh(tuple((x, y, z) for x, y, z in x), tuple((a, b, c) for a, b, c in corners))
    return mesh.encode()
