"""The settings of a client, their checks, and the limits that the device adds to them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from cohaptic.control.friction import MAX_FRICTION
from cohaptic.control.law import DEFAULT_LAW, Law
from cohaptic.control.laws.model import Thresholds
from cohaptic.errors import SettingError
from cohaptic.protocol.messages import MAX_TOKEN, FixedGains, GeometryName
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import HandScript
from cohaptic_client.address import check_secrecy
from cohaptic_client.devices.catalogue import device_info
from cohaptic_client.devices.kind import SIMULATED, DeviceChoice
from cohaptic_client.devices.placing.options import clutch_is_switch
from cohaptic_client.loop.added import RuleChoice, check_rules
from cohaptic_client.loop.config import haptic_period
from cohaptic_client.loop.passivity import device_damping_limit


@dataclass(frozen=True, slots=True)
class ClientSettings:
    """Settings of one client.

    Args:
        url: URL of the server, ws: or wss:.
        name: Name of the user, which the other users see.
        law: Local model that computes the force.
        geometry: Geometry of the local surface.
        fixed_gains: Gains that the law uses in place of the server's choice, if the server allows
            that; None for the server's choice.
        thresholds: Thresholds of the law's integral, eqs. (17), (18).
        smoothing: Fraction of a simulation period over which the loop moves from one patch to the
            next, 0 to 1; at 0 the surface jumps to each new patch, as in the paper.
        friction: Coefficient of friction mu of the contact; 0 for none.
        passivity: Whether the passivity layer is on.
        models: Whether the loop moves models of the other hands, which answer at once.
        rules: Rules of other packages in the loop, by the names of their entry points in
            `cohaptic.rules`, or rules of a script; in the order in which they act.
        device: Device with its options, as `catalogue.read_device` reads them.
        loop_hz: Rate of the haptic loop [Hz]; its reciprocal is the haptic period T.
        max_force: Largest force on the hand [N].
        up: Latency that the client injects into messages to the server.
        down: Latency that the client injects into messages from the server.
        script: Script of a simulated hand.
        patience: Time for which the client tries to reach a server at first [s].
        patience_lost: Time for which the client tries to reach a server that it has lost [s]; None
            for the value of `patience`.
        duration: Time after which the client fades the force and leaves [s]; None to wait for
            Ctrl-C.
        token: Token of an invitation; empty for none.
        ca_file: File with the certificates to trust; empty for the system's certificates.
        wait_seat: Whether the client waits in the queue if the room is full.
        insecure: Whether a token may go to another machine without TLS.
        dead_man: Whether there is force only while the user holds the device's switch, if the
            device has one.
        hold_faults: Whether the force stays off after a fault until the user acknowledges it; None
            means yes for real devices with motors, and no for others.
    """

    url: str
    name: str
    law: Law = DEFAULT_LAW
    geometry: GeometryName = "plane"
    fixed_gains: FixedGains | None = None
    thresholds: Thresholds = field(default_factory=Thresholds)
    smoothing: float = 1.0
    friction: float = 0.0
    passivity: bool = True
    models: bool = True
    rules: tuple[RuleChoice, ...] = ()
    device: DeviceChoice = SIMULATED
    loop_hz: float = 1000.0
    max_force: float = 10.0
    up: LinkSettings = field(default_factory=LinkSettings)
    down: LinkSettings = field(default_factory=LinkSettings)
    script: HandScript = field(default_factory=HandScript)
    patience: float = 0.0
    patience_lost: float | None = None
    duration: float | None = None
    token: str = field(default="", repr=False)
    ca_file: str = ""
    insecure: bool = False
    dead_man: bool = True
    hold_faults: bool | None = None
    wait_seat: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.max_force <= 100.0:
            raise SettingError("max force", f"{self.max_force} N", "above 0, at most 100 N")
        _check_name(self.name)
        if not 0.0 <= self.friction <= MAX_FRICTION:
            raise SettingError("friction", self.friction, f"from 0 to {MAX_FRICTION:g}")
        if not 0.0 <= self.smoothing <= 1.0:
            raise SettingError("smoothing", self.smoothing, "from 0 to 1")
        if self.duration is not None and not self.duration > 0.0:
            raise SettingError("duration", f"{self.duration} s", "above 0")
        if not self.patience >= 0.0:
            raise SettingError("wait", f"{self.patience} s", "0 or more")
        if self.token:
            if len(self.token) > MAX_TOKEN or not re.fullmatch(r"[!-~]+", self.token):
                limit = f"at most {MAX_TOKEN} printable characters, as `cohaptic token` prints it"
                raise SettingError("token", "not whole", limit)
            check_secrecy(self.url, insecure=self.insecure)
        # Period and device are needed only once a server answers, but mistakes are reported now.
        haptic_period(self.loop_hz)
        check_rules(self.rules, self.law)
        device = device_info(self.device)
        if self.dead_man and clutch_is_switch(self.device, device):
            limit = "a button other than the switch that the hand holds; or give --no-dead-man"
            raise SettingError(f"{self.device.name}:clutch", 1, limit)

    @property
    def force_limit(self) -> float:
        """Largest force on the hand [N], or on the body if the device has no motors."""
        return min(self.max_force, device_info(self.device).max_force or self.max_force)

    @property
    def holds_faults(self) -> bool:
        """Whether the force stays off after a fault until the user acknowledges the fault.

        Simulated hands and devices without motors hurt nobody, and a demo has no user to press a
        key: by default, their force returns once the hand has left the object.
        """
        if self.hold_faults is not None:
            return self.hold_faults
        info = device_info(self.device)
        return info.held and info.max_force > 0.0

    @property
    def moves_models(self) -> bool:
        """Whether the server is asked for partners.

        Nothing is proved with friction, for gains of one's own and for the laws of the paper, and a
        device without motors does not give way.
        """
        plain = self.friction == 0.0 and self.fixed_gains is None and self.smoothing == 1.0
        felt = device_info(self.device).max_force > 0.0
        return self.models and plain and felt and not self.law.answers_own_dent

    @property
    def damping_limit(self) -> float:
        """Largest damping of the passivity layer on this device, by Colgate's bound [N s/m]."""
        if not self.passivity:
            return 0.0
        device = device_info(self.device)
        period = haptic_period(self.loop_hz)
        return device_damping_limit(device.damping, device.max_stiffness, period)


def _check_name(name: str) -> None:
    from cohaptic.protocol.control.message import tidy_name

    limit = "1 to 32 printable characters"
    if not name or len(name) > 32 or not name.isprintable():
        raise SettingError("name", repr(name), limit)
    try:
        tidy_name(name)
    except ValueError as error:
        raise SettingError("name", repr(name), f"{limit}: {error}") from error
