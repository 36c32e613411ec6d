"""A whole session in virtual time: the real room, world, frames, links, loops and hands; no I/O.

Sockets, processes and schedulers, which need real time, are left out. Nothing in it is random but
by a seed, so that a session is the same each time, to the last bit, on one machine.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from cohaptic.control.hand_model import HandModel
from cohaptic.control.law import Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.messages import FixedGains, GeometryName, Hello, SetLaw
from cohaptic.protocol.patch import Patch
from cohaptic.protocol.rest_mesh import RestMesh
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.sessions.recorder import SessionRecorder
from cohaptic.simulated.delay_line import DelayLine, LinkSettings
from cohaptic.simulated.hand import Hand, HandScript, HandState, Intention, move
from cohaptic.simulated.networks import read_network
from cohaptic.vec import ZERO, Vec3, dot, norm, sub
from cohaptic_client.devices.device import Device, DeviceSample
from cohaptic_client.devices.simulated import INFO, SimulatedDevice
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.config import law_settings, silent_after
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.safety import SafetyLimits, rate_of
from cohaptic_client.loop.state import LoopSettings, LoopState, SurfaceMaker
from cohaptic_client.loop.step import step
from cohaptic_client.network.timing import Pacer
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.green import green_source
from cohaptic_server.room.body_frames import describe
from cohaptic_server.room.input_record import InputRecord
from cohaptic_server.room.room import Room
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.recording import Keeper, Recording, info_of

PERIOD = 0.001  # s
_USUAL = Thresholds()


@dataclass
class VirtualUser:
    """One client of a [`VirtualSession`][cohaptic_experiments.VirtualSession], without processes.

    Attributes:
        number: Number of the user in the room.
        device: Device that the loop reads and writes.
        force: Size of the force on the hand in each haptic period since it joined [N].
        felt: Part of the force that the others cause, in each period [N].
        u_others: Displacement of the contact by the others along the normal, in each period [m].
        ticks: Tick of each patch that has come.
        state: State of the haptic loop.
        listening: Whether patches are taken; False for a downlink that is dead.
        talking: Whether samples are sent; False for an uplink that is dead.
    """

    number: int
    device: Device
    settings: LoopSettings
    up: DelayLine[bytes]
    down: DelayLine[bytes]
    pacer: Pacer
    state: LoopState = field(default_factory=LoopState)
    seq: int = 0
    ticks: list[int] = field(default_factory=list[int])
    force: list[float] = field(default_factory=list[float])
    felt: list[float] = field(default_factory=list[float])
    u_others: list[float] = field(default_factory=list[float])
    # Change of the contact's force in each period that neither the hand's own motion nor the
    # damping explains [N].
    unexplained: list[float] = field(default_factory=list[float])
    listening: bool = True
    talking: bool = True
    # The hand, where the client tells it as the page does, and what forces have moved of it.
    own_hand: Hand | None = None
    _gave: HandState = field(default_factory=lambda: HandState(ZERO, ZERO))
    _on_body: Vec3 = ZERO
    _on_hand: Vec3 = ZERO

    def period(self, now: float) -> None:
        """One haptic period: the messages that have come, the device, and a sample if it is due."""
        inbox, sample = self.down.pop_due(now), self.device.read(now)
        force, frame = self.client(now, sample, inbox)
        self.device.write(force)
        if frame is not None:
            self.up.push(frame, now)

    def client(
        self, now: float, sample: DeviceSample, inbox: Sequence[bytes]
    ) -> tuple[Vec3, bytes | None]:
        """One haptic period, as the processes of a client do it.

        Args:
            now: Time of the period [s].
            sample: State of the device's tip.
            inbox: Patches that have come since the last period.

        Returns:
            Force for the device [N], and a sample for the server, if one is due.
        """
        for frame in inbox:
            patch = Patch.decode(frame)
            if self.listening:
                self.ticks.append(patch.tick)
                self.state = receive(self.state, patch, now, self.settings)
                if patch.seq:
                    self.pacer = self.pacer.reported(patch.t_client, patch.sample_wait)
        if self.own_hand is not None:
            self._gave = move(self._gave, self.own_hand, ZERO, self._on_hand, PERIOD)
        before, previous = self.state, self._on_body
        self.state, output = step(self.state, sample, now, self.settings)
        self._note(output)
        self._on_body, self._on_hand = output.on_body, output.force
        self.unexplained.append(self._unexplained_change(before, previous, output.on_body))
        if self.pacer.due > now or not self.talking:
            return output.force, None
        self.pacer = self.pacer.sent(now)
        self.seq += 1
        tick = self.state.patch.tick if self.state.patch else 0
        deflection, own_model = output.deflection, None
        if (hand := self.own_hand) is not None:
            deflection = dot(self._gave.position, self.state.normal)
            own_model = HandModel(hand.mass, hand.damping, hand.stiffness)
        reported = ContactSample(
            self.seq,
            tick,
            now,
            sample.position,
            output.on_body,
            output.anchor,
            deflection,
            own_model,
        )
        return output.force, reported.encode()

    def _unexplained_change(self, before: LoopState, previous: Vec3, on_body: Vec3) -> float:
        """Change of the contact's force beyond the hand's own displacement times K [N].

        The contact presses along its own normal, which follows that of the shown surface no faster
        than the limits allow: what counts as the hand's own is its way along that one.
        """
        if self.state.sight is None:
            return 0.0
        way = sub(self.state.probe, before.probe)
        if self.settings.friction > 0.0:
            largest = (1.0 + self.settings.friction) * max(self.state.k_h, self._max_stiffness())
            return norm(sub(on_body, previous)) - largest * norm(way)
        change = norm(on_body) - norm(previous)
        expected = max(self.state.k_h, before.k_h) * -dot(self.state.normal, way)
        if self.state.replica is not None:
            expected += self.state.k_h * self.state.replica.model_change
        return max(change - max(0.0, expected), min(0.0, expected) - change)

    def _max_stiffness(self) -> float:
        return min(self.settings.max_stiffness, 1e6)

    def _note(self, output: Period) -> None:
        self.force.append(norm(output.force))
        self.felt.append(self.state.safety.scale * output.local.felt_from_others)
        self.u_others.append(output.u_others)


class VirtualSession:
    """A room and its users in virtual time: deterministic, without sockets, processes or clocks.

    The code of room, world, frames, links, loops and hands is that of a real session. A second of
    two users takes about as long as a second.

    Args:
        body: Body that the users touch.
        simulation_hz: Ticks per second [Hz].
        now: Time at which the session begins [s].

    Attributes:
        room: The room, as a server has it.
        users: The users who have joined, by name.
        now: Present time [s].
        recording: Recording of the session; None while nothing records it.
    """

    def __init__(self, body: Body, simulation_hz: float = 60.0, now: float = 100.0) -> None:
        self.room = Room(body, ServerSettings(simulation_hz=simulation_hz, allow_fixed_gains=True))
        self.users: dict[str, VirtualUser] = {}
        self.now = now
        self.recording: Recording | None = None
        self._next_tick = self.now

    # Above 60 lines: every option of a client is a parameter, as experiments vary each of them.
    def join(
        self,
        name: str,
        script: HandScript,
        *,
        law: Law = Law.PREDICTIVE,
        delay: float = 0.0,
        jitter: float = 0.0,
        network: str | LinkSettings = "",
        seed: int = 0,
        fixed_gains: FixedGains | None = None,
        thresholds: Thresholds = _USUAL,
        smoothing: float = 1.0,
        passivity: bool = True,
        max_damping: float = MAX_DAMPING,
        max_stiffness: float | None = None,
        limits: SafetyLimits | None = None,
        intention: Intention | None = None,
        geometry: GeometryName = "plane",
        friction: float = 0.0,
        device: Device | None = None,
        models: bool = False,
        tells_hand: bool = False,
    ) -> VirtualUser:
        """Let a user join now.

        Args:
            name: Name of the user.
            script: Script of the simulated hand.
            law: Local model.
            delay: One way [s].
            jitter: Largest extra delay, one way [s].
            network: Network in words as after `--network`, or a link, for both ways; `delay` and
                `jitter` are added to its own.
            seed: Seed of what is random in the network.
            fixed_gains: Instead of the server's choice.
            thresholds: Thresholds of the law's integral.
            smoothing: Ramp from patch to patch, in simulation periods.
            passivity: Whether the passivity layer is on.
            max_damping: Damping budget of the device [N s/m].
            max_stiffness: That the device renders; None for its own [N/m].
            limits: Limits of the safety layer; None for the usual ones.
            intention: Instead of the one that `script` has for round bodies.
            geometry: Geometry of the patches.
            friction: Coefficient of friction.
            device: Instead of a simulated hand.
            models: Whether the client moves models of the hands.
            tells_hand: Whether the client tells the hand that it simulates, as the page does.
        """
        if not passivity:
            max_damping = 0.0
        if max_stiffness is None:
            max_stiffness = (device.info if device else INFO).max_stiffness
        hello = Hello(
            protocol=PROTOCOL_VERSION,
            name=name,
            law=law,
            fixed_gains=fixed_gains,
            geometry=geometry,
            friction=friction > 0.0,
            max_stiffness=max_stiffness,
            max_force=limits.max_force if limits else INFO.max_force,
            damping_budget=max_damping,
            models=models,
        )
        welcome, _, _ = self.room.join(hello, self.now)
        info = describe(self.room.body)
        link = read_network(network) if isinstance(network, str) else network
        link = replace(link, delay=link.delay + delay, jitter=link.jitter + jitter)
        period = self.room.settings.simulation_period
        # As the wire carries it: rounded to 32 bits.
        mesh = RestMesh.decode(self.room.frames.touch_mesh()) if geometry == "mesh" else None
        usual = limits or SafetyLimits(max_rate=rate_of(max_stiffness))
        limits = replace(usual, silent_after=silent_after(period))
        user = VirtualUser(
            number=welcome.user,
            device=device
            or SimulatedDevice(
                script.hand, intention or script.intention(info.center, info.radius)
            ),
            settings=LoopSettings(
                period,
                limits,
                law_settings(thresholds, period, limits),
                smoothing,
                max_damping,
                SurfaceMaker(mesh),
                friction,
                follow=fixed_gains is None,
                max_stiffness=max_stiffness,
            ),
            up=DelayLine(replace(link, seed=2 * seed)),
            down=DelayLine(replace(link, seed=2 * seed + 1)),
            pacer=Pacer(period, self.now),
            own_hand=script.hand if tells_hand else None,
        )
        self.users[name] = user
        return user

    @contextlib.contextmanager
    def record(self, path: str | Path) -> Generator[None]:
        """Record the room while the block runs: what it hears, its patches and scenes.

        Args:
            path: Path of the session file, which must not exist.

        Raises:
            SettingError: The file exists, or cannot be made.
            OutputError: It cannot be written; what there is of it is kept.
        """
        info = info_of(self.room, self.now, 0.0)
        recorder = SessionRecorder(Path(path), info, tell=warnings.warn, option="record")
        self.keep_in(recorder)
        try:
            yield
        finally:
            self.room.record = self.recording = None
            recorder.finish()

    def keep_in(self, keeper: Keeper, *, surfaces: bool = False) -> None:
        """Give all entries of the session to a keeper from now on.

        Args:
            keeper: Takes the entries, such as a recorder of a file.
            surfaces: Whether scenes have their surface though it follows from the contacts.
        """
        room = self.room
        follows = not surfaces and green_source(room.body) is not None
        room.record = InputRecord(keeper.add, room.members.values(), self.now)
        self.recording = Recording(keeper, room, self.now, follows=follows)

    def set_law(self, name: str, law: Law, fixed_gains: FixedGains | None = None) -> None:
        """A user changes its law, at once."""
        self.room.set_law(
            self.users[name].number, SetLaw(law=law, fixed_gains=fixed_gains), self.now
        )

    def drop(self, name: str) -> None:
        """A client dies: its socket closes, and its loop ends."""
        self.room.leave(self.users.pop(name).number, self.now)

    def run(self, seconds: float) -> None:
        """Let time pass [s]."""
        self.step(round(seconds / PERIOD))

    def step(self, periods: int = 1) -> None:
        """Let so many haptic periods of 1 ms pass, with the ticks that come due in them."""
        for _ in range(periods):
            self.now += PERIOD
            for user in self.users.values():
                for frame in user.up.pop_due(self.now):
                    self.room.sample(user.number, ContactSample.decode(frame), self.now)
            if self.now >= self._next_tick:
                self._tick()
            for user in self.users.values():
                user.period(self.now)

    def _tick(self) -> None:
        self._next_tick += self.room.settings.simulation_period
        patches = self.room.tick(self.now)
        for user in self.users.values():
            if user.number in patches:
                user.down.push(patches[user.number].encode(), self.now)
        if self.recording is not None:
            self.recording.after_tick(self.now)
