"""The users of one body and their newest samples: a state machine without I/O.

A sample is state: each user writes only its own sample, a new sample replaces the last one, and the
force of a user that stays silent fades. Joining and leaving are events.

The number of users is bounded by the room's own limit, and by the number of seats that the server
assigns to the room.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from cohaptic.control.law import Law
from cohaptic.errors import CloseCode, RemoteProtocolError
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import (
    FixedGains,
    Hello,
    Restraints,
    RoomUser,
    SetLaw,
    UserJoined,
    UserLeft,
    Welcome,
)
from cohaptic.protocol.patch import Patch
from cohaptic_server.access.admission import ANYBODY, Guest
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.touched_body import TouchedBody
from cohaptic_server.room.body_frames import BodyFrames, describe
from cohaptic_server.room.input_record import InputRecord
from cohaptic_server.room.life import Hand, hand_of
from cohaptic_server.room.member import Member, Muted, participant
from cohaptic_server.room.seats.names import Claim, KeptNames, looks_like, may_replace
from cohaptic_server.room.seats.wait_queue import WaitQueue
from cohaptic_server.settings import ServerSettings
from cohaptic_server.world.applied_forces import RELEASE_TIME, within_budget
from cohaptic_server.world.state import Touch
from cohaptic_server.world.tick import advance
from cohaptic_server.world.users import WorldState, is_at_rest, pass_over


@dataclass(slots=True)
class Seating:
    """Number of seats that a room may fill with users, or with watchers.

    Several rooms of a server may share its seats; the server then assigns each room a number of
    them.

    Args:
        capacity: Largest number of seats of the room.
        who: Word for the people, such as "users", for messages.
        instead: Text that tells a client without a seat what to do instead.

    Attributes:
        held: Number of the server's seats that are assigned to this room; None if rooms share no
            seats.
        wanted: Number of seats that the server wants this room to have; seats in use beyond it are
            given back when somebody leaves.
    """

    capacity: int
    who: str
    instead: str = ""
    held: int | None = None
    wanted: int = 0

    def allow(self, wanted: int, used: int) -> None:
        """Assign `wanted` seats to the room from now on, or `used` seats if that is more."""
        self.wanted = wanted
        self.held = max(wanted, used)

    def give_back(self, used: int) -> int:
        """Give back seats that are neither wanted nor in use; return the number still assigned."""
        if self.held is None:
            return self.capacity
        self.held = min(self.held, max(self.wanted, used))
        return self.held

    @property
    def limit(self) -> int:
        """Number of people that may have a seat at present."""
        return self.capacity if self.held is None else min(self.capacity, self.held)

    def check(self, present: int, kept: int = 0, promised: int = 0) -> None:
        """Raise RemoteProtocolError if there is no seat for one more person.

        Args:
            present: Number of people in the room.
            kept: Number of further seats reserved for people whose connections were just lost.
            promised: Number of further seats promised to people who came earlier and wait.
        """
        limit = self.limit
        if present + kept + promised < limit:
            return
        words = (
            f"at most {limit}"
            if limit == self.capacity
            else (f"at most {limit}: the other rooms of this server have its other seats")
        )
        if kept:
            words += f"; {kept} of them kept a few seconds for who lost the connection: try again"
        if promised:
            words += f"; {promised} wait for a place already"
        count = present + kept + promised + 1
        name, words = f"number of {self.who}", words + self.instead
        raise RemoteProtocolError(name, count, words, CloseCode.ROOM_FULL, self.who)


RESET_AFTER = 2.0 * RELEASE_TIME  # s; every force has faded by then


class Room:
    """The users of one body, and the state of the simulation.

    Args:
        body: The deformable object.
        first_user: Number of the first user; larger than all user numbers of earlier rooms.

    Attributes:
        world: State of the simulation after the last tick.
        members: Users in the room, by number.
        patches: Patches of the last tick, by user number.
        frames: Encoded meshes of the body.
        next_user: Number that the next user to join will get.
        frozen: Whether an administrator has frozen the body, so that it takes no forces.
        left_alone: Last time at which an administrator was in the frozen room, or else the time at
            which the freeze was first seen [s]; None before that.
        force_budget: Limit on the sum of all users' forces [N]; None if only the simulation limits
            it.
        seats, watch_seats: Seats of users, and of watchers.
        queue: People who wait for a seat.
        muted: Users whom an administrator has muted.
        kept: Names that are reserved for users whose connections were lost.
        record: Takes down what the room takes in; None while nothing records it.
    """

    def __init__(self, body: Body, settings: ServerSettings, first_user: int = 1) -> None:
        self.body = body
        self.touched_body = TouchedBody(body)
        self.settings = settings
        self.world = WorldState()
        self.members: dict[int, Member] = {}
        self.patches: dict[int, Patch] = {}
        self.frames = BodyFrames(self.touched_body)
        self.next_user = first_user
        instead = "; you can watch on the page meanwhile"
        if settings.max_waiting:
            instead += ", or wait for a place"
        self.seats = Seating(settings.max_users, "users", instead)
        self.queue = WaitQueue(settings.max_waiting, settings.limits.waiting)
        self.watch_seats = Seating(settings.max_watchers, "watchers")
        self.muted = Muted()
        self.kept = KeptNames()
        self.record: InputRecord | None = None
        self.frozen = False
        self.left_alone: float | None = None
        self.force_budget: float | None = None
        self._reset_at: float | None = None
        self._ticked: float | None = None  # time of the last tick [s]; None after a rest

    # Above 60 lines: the method checks in one place all that a hello may ask for.
    def join(
        self,
        hello: Hello,
        now: float,
        source: str = "",
        guest: Guest = ANYBODY,
        *,
        called: bool = False,
    ) -> tuple[Welcome, UserJoined, tuple[UserLeft, ...]]:
        """Add a user to the room.

        Args:
            hello: First message of the user.
            now: Time [s].
            source: Network address against whose rate limits the user's connection counts.
            guest: Identity and grants of the user.
            called: Whether the user has waited in the queue and was called to a seat.

        Returns:
            The welcome for the user; the message for the other users; and a leave message for each
            member with the same name or the same session, whom the user replaces. The caller ends
            the sessions of the replaced members.

        Raises:
            RemoteProtocolError: The name is in use, the room is full, or the client asks for gains,
                a law or a geometry that it cannot have.
        """
        holder = next((m for m in self.members.values() if m.hello.name == hello.name), None)
        self._check_gains(hello.fixed_gains)
        self._check_law(hello.law)
        self.frames.check_geometry(hello.geometry)
        claim = Claim(hello.key, source, guest.session)
        if holder is None:
            self.kept.check(hello.name, claim, now)
        elif not may_replace(holder.claim, now - holder.heard, claim):
            self.check_name(hello.name)
        # A session has one seat under all its names, since its token may have been passed on.
        replaced = [m for m in self.members.values() if m is holder or claim.is_session_of(m.claim)]
        self.check_name(hello.name, [member.user for member in replaced])
        if not replaced:
            own = self.kept.seats_of(hello.name, claim, now)
            kept = self.kept.seats(now) - own
            promised = self.queue.called if own or called else len(self.queue)
            self.seats.check(len(self.members), kept, promised)
        self.kept.forget(hello.name, claim)
        left = tuple(self._replace(member, now) for member in replaced)
        user = self.next_user
        self.next_user += 1
        present = tuple(RoomUser(user=m.user, name=m.hello.name) for m in self.members.values())
        capacity = guest.grants.max_force
        cap = hello.max_force if capacity is None else min(hello.max_force, capacity)
        muted = self.muted.holds(hello.name, claim)
        member = Member(participant(user, hello, cap), hello, now, claim, muted)
        self.members[user] = member
        if self.record is not None:
            self.record.joined(member, now)
        welcome = Welcome(
            user=user,
            name=hello.name,
            simulation_period=self.settings.simulation_period,
            body=describe(self.body),
            users=present,
        )
        return welcome, UserJoined(user=user, name=hello.name, rules=hello.rules), left

    def sample(self, user: int, sample: ContactSample, now: float) -> None:
        """Store a contact sample as the newest touch of a user."""
        member = self.members[user]
        hello = member.hello
        deflection, own_model = None, sample.own_model
        if hello.models:
            # There is no deflection before the first patch with partners.
            deflection, own_model = sample.deflection or 0.0, None
        elif own_model is not None:
            deflection = sample.deflection
        # Positional arguments, since keyword arguments would double the time of this method.
        touch = Touch(
            member.who,
            sample.probe,
            sample.force,
            sample.seq,
            sample.tick,
            sample.t_client,
            now,
            True,
            sample.anchor if hello.friction else None,
            deflection,
            own_model,
        )
        member.samples = member.samples.heard(touch)
        member.heard = now
        if self.record is not None:
            self.record.heard(user, sample, now)

    def set_law(self, user: int, change: SetLaw, now: float) -> None:
        """Change the control law of a user's patches, at a time [s].

        Raises:
            RemoteProtocolError: The change asks for gains, which this server does not let users
                choose, or for a law that the room does not have.
        """
        self._check_gains(change.fixed_gains)
        self._check_law(change.law)
        member = self.members[user]
        member.hello = member.hello.model_copy(
            update={"law": change.law, "fixed_gains": change.fixed_gains}
        )
        member.who = participant(user, member.hello, member.who.max_force)
        member.samples = member.samples.of(member.who)
        if self.record is not None:
            self.record.law(user, change, now)

    def _check_gains(self, gains: FixedGains | None) -> None:
        if gains is not None and not self.settings.allow_fixed_gains:
            raise RemoteProtocolError(
                "fixed_gains",
                f"{gains.k_h:g} N/m",
                "none: start the server with --allow-fixed-gains to choose gains yourself",
            )

    def _check_law(self, law: Law) -> None:
        if law not in self.settings.laws:
            known = " or ".join(other.value for other in self.settings.laws)
            raise RemoteProtocolError("law", law.value, f"{known}, as this room has it")

    def leave(
        self, user: int, now: float, reason: str = "left", *, lost: bool = False, seat: bool = True
    ) -> UserLeft | None:
        """Remove a user, whose force then fades; return None if the user is not in the room.

        Args:
            user: Number of the user.
            now: Time [s].
            reason: Reason that the other users are told.
            lost: Whether the connection was lost, so that the room reserves the user's name; False
                if it was ended on purpose.
            seat: Whether the room also reserves the seat of a lost connection.
        """
        member = self.members.pop(user, None)
        if member is None:
            return None
        if lost:
            since = member.joined if seat else None
            self.kept.keep(member.hello.name, member.claim, now, since=since)
        if self.record is not None:
            self.record.left(user, reason, now)
        return UserLeft(user=user, name=member.hello.name, reason=reason)

    def check_name(self, name: str, but: Collection[int | None] = ()) -> None:
        """Raise RemoteProtocolError if a user has this name, or a name that looks like it.

        Args:
            name: Name that a client wants.
            but: Numbers of users whose names do not count.
        """
        others = [m.hello.name for m in self.members.values() if m.user not in but]
        taken = next((other for other in others if looks_like(name, other)), None)
        if taken is not None:
            too = "" if taken == name else ", and looks like it"
            limit = f"another one: {taken} is taken{too} (taken: {', '.join(sorted(others))})"
            raise RemoteProtocolError("name", name, limit, CloseCode.NAME_TAKEN)

    def _replace(self, member: Member, now: float) -> UserLeft:
        left = self.leave(member.user, now, "replaced by its return")
        assert left is not None  # it is one of the members
        return left

    def seated(self, now: float) -> int:
        """Return the number of seats that users, lost connections and called people occupy."""
        return len(self.members) + self.kept.seats(now) + self.queue.called

    def call(self, now: float) -> tuple[int, ...]:
        """Call waiting people to free seats; return the queue numbers of the called people."""
        taken = len(self.members) + self.kept.seats(now)
        self.queue, called = self.queue.call(self.seats.limit - taken, now)
        return called

    def name_of(self, user: int) -> str:
        """Return the name of a user; the number as text if the user is not in the room."""
        return self.members[user].hello.name if user in self.members else str(user)

    @property
    def restrains(self) -> bool:
        """Whether an administrator has frozen the body or muted a user."""
        return self.restraints != Restraints()

    @property
    def restraints(self) -> Restraints:
        """Message that says whether the body is frozen, and which users are muted."""
        muted = tuple(user for user, member in self.members.items() if member.muted)
        return Restraints(frozen=self.frozen, muted=muted)

    def take_over(self, before: Room) -> None:
        """Copy seats, reserved names and an administrator's orders from the previous room."""
        self.seats, self.watch_seats, self.kept = before.seats, before.watch_seats, before.kept
        self.muted, self.frozen = before.muted, before.frozen
        self.force_budget = before.force_budget

    def reset(self, now: float) -> None:
        """Return the body to its initial state after `RESET_AFTER`, when every force has faded."""
        self._reset_at = now + RESET_AFTER
        if self.record is not None:
            self.record.reset(now)

    def tick(self, now: float) -> dict[int, Patch]:
        """Advance the simulation by one period; return the patches by user number.

        The force of a user whose samples have stopped fades, but the user still gets patches, since
        only the uplink of the client may have stalled.
        """
        if self.record is not None:
            self.record.ticked(self.world.tick + 1, self.restraints, self.force_budget, now)
        if self._reset_at is not None and now >= self._reset_at:
            self.world, self._reset_at = WorldState(self.world.tick), None
        released = self.frozen or self._reset_at is not None
        touches = list[Touch]()
        for member in self.members.values():
            if (newest := member.touch) is None:
                continue
            if newest.seq != member.seen:
                member.seen = newest.seq
                member.used += 1
            member.samples, touch = member.samples.read(now)
            hand = hand_of(frozen=released, muted=member.muted, silence=now - member.heard)
            touches.append(touch if hand is Hand.ACTS else replace(touch, fresh=False))
        if self.force_budget is not None:
            touches = within_budget(touches, self.force_budget)
        dt = self.settings.simulation_period
        elapsed = None if self._ticked is None else now - self._ticked
        self._ticked = now
        self.world, self.patches = advance(
            self.touched_body, self.world, touches, now=now, dt=dt, elapsed=elapsed
        )
        return self.patches

    @property
    def at_rest(self) -> bool:
        """Whether a tick would change nothing but the tick number."""
        waits = self.frozen or self._reset_at is not None  # the end of either needs ticks
        return not (self.members or waits) and is_at_rest(self.world)

    def pass_over(self, ticks: int, now: float) -> None:
        """Count ticks that passed while the room was at rest, the last one at a time [s]."""
        if self.record is not None:
            self.record.passed_over(ticks, now)
        self.world, self.patches = pass_over(self.world, ticks), {}
        self._ticked = None  # the first tick after a rest is as long as any other
