"""The linearised closed loop of two hands on a thin limb: its spectral radius, and its sessions.

    python benchmarks/limb_stability.py [--limbs limb rod] [--seeds 100 101] [--delays-ms 0 80]

A real session (room, world, frames, links, haptic loops, hands) is brought to an equilibrium, then
a twin of it gets a small push for a moment; the difference of the two is the free response of the
linearised loop. Six pushes, three axes of both hands, give the impulse responses from which a
minimal realisation is identified (Ho and Kalman; Juang and Pappa 1985). Its spectral radius over
one common period of ticks and haptic periods is `rho`. No model of the physics is in between.
Where the forces still drift by more than `STILL` there is no equilibrium, and `rho` says nothing;
near 1 it depends on the rank that is taken for noise, so `trend`, the slope of the late response's
logarithm, stands beside it, and where the two disagree neither is to be believed.

To reach an equilibrium that may be unstable, others turn contacts very slowly on the way there. The
search for a contact is done to `_FINE`: the few hundredths of a millimetre within which a contact
stays in the product are no linear map.

Beside it a session of the same hands is played as it is, and judged: it rests if no force changes
by more than a ripple at its end.
"""

from __future__ import annotations

import copy
from argparse import ArgumentParser
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

import json_report
from cohaptic.control.law import Law
from cohaptic.simulated.hand import Hand, HandScript, HandState, Intention, move
from cohaptic.vec import ZERO, Vec3, add
from cohaptic_client.devices.device import DeviceInfo, DeviceSample
from cohaptic_client.devices.simulated import INFO
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession, VirtualUser
from cohaptic_server.bodies.body import Body
from cohaptic_server.demo.rest import RIPPLE, RIPPLE_SHARE
from cohaptic_server.numeric import Floats
from cohaptic_server.world import contact, contact_tracking
from limbs import LIMBS, Press, draw

HAND = Hand()
SAMPLE = 0.05  # s; three ticks at 60 Hz, and 50 haptic periods
PUSH, PUSHED_FOR = 1e-4, 0.2  # m, s; of an intention
_FINE = 1e-8  # m
_SLOW = 1.0  # s; of the turning on the way to an equilibrium
_APPROACH = 1.7  # s, with the time before it
_NOISE = 1e-2  # singular values of responses in 32 bits below this share of the largest
STILL = 2e-4  # N by which a force may drift in a second at an equilibrium

Row = dict[str, Any]


@dataclass
class PushedHand:
    """A hand that follows an intention, pushed by `push`; its state can be read and copied."""

    intention: Intention
    hand: HandState
    push: Vec3 = ZERO
    force: Vec3 = ZERO
    start: float | None = None

    @property
    def info(self) -> DeviceInfo:
        """Of a simulated device."""
        return INFO

    def read(self, now: float) -> DeviceSample:
        """Move the hand by one haptic period under the force written last."""
        self.start = now if self.start is None else self.start
        target = add(self.intention.at(now - self.start), self.push)
        self.hand = move(self.hand, HAND, target, self.force, PERIOD)
        return DeviceSample(self.hand.position, self.hand.velocity)

    def write(self, force: Vec3) -> None:
        """Force on the hand until the next read [N]."""
        self.force = force

    def close(self) -> None:
        """Nothing is held."""


def _device(user: VirtualUser) -> PushedHand:
    assert isinstance(user.device, PushedHand)
    return user.device


@contextmanager
def replaced(module: Any, **values: Any) -> Iterator[None]:
    """Attributes of a module replaced for a while."""
    before = {name: getattr(module, name) for name in values}
    for name, value in values.items():
        setattr(module, name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            setattr(module, name, value)


def joined(body: Body, presses: tuple[Press, ...], delay: float, law: Law) -> VirtualSession:
    """A session whose hands approach and then hold still."""
    session = VirtualSession(body)
    for k, press in enumerate(presses):
        script = HandScript(depth=press.depth, approach_at=1.0 + 2.0 * delay, place=press.place)
        intention = script.intention(ZERO, 1.0)
        device = PushedHand(intention, HandState(intention.at(0.0), ZERO))
        session.join(f"hand {k}", script, law=law, delay=delay, seed=k, device=device)
    return session


def twin(session: VirtualSession) -> VirtualSession:
    """A session in the same state, which goes on by itself; frozen values are shared."""
    other, room = copy.copy(session), copy.copy(session.room)
    room.members = {k: copy.copy(member) for k, member in room.members.items()}
    room.patches = dict(room.patches)
    other.room, other.users = room, {name: _twin(user) for name, user in session.users.items()}
    return other


def _twin(user: VirtualUser) -> VirtualUser:
    other = copy.copy(user)
    other.device = replace(_device(user))
    for name in ("up", "down"):
        line = copy.copy(getattr(user, name))
        line._items = deque(line._items)
        setattr(other, name, line)
    for name in ("ticks", "force", "felt", "u_others", "unexplained"):
        setattr(other, name, [])
    return other


def signals(session: VirtualSession) -> Floats:
    """Forces over their stiffness, and places of both tips, shape (12,) [m]."""
    values: list[float] = []
    for user in session.users.values():
        device = _device(user)
        values += [f / max(user.state.k_h, 1.0) for f in device.force]
        values += device.hand.position
    return np.array(values)


def responses(session: VirtualSession, seconds: float) -> Floats:
    """Free responses after a push of each hand along each axis, shape (samples, 12, 6)."""
    count = round(seconds / SAMPLE)

    def play(pushed: tuple[str, Vec3] | None) -> Floats:
        other = twin(session)
        if pushed:
            _device(other.users[pushed[0]]).push = pushed[1]
        other.run(PUSHED_FOR)
        if pushed:
            _device(other.users[pushed[0]]).push = ZERO
        rows: list[Floats] = []
        for _ in range(count):
            other.run(SAMPLE)
            rows.append(signals(other))
        return np.array(rows)

    base = play(None)
    ways: list[Vec3] = [(PUSH, 0.0, 0.0), (0.0, PUSH, 0.0), (0.0, 0.0, PUSH)]
    pushes = [(name, way) for name in session.users for way in ways]
    return np.stack([play(pushed) - base for pushed in pushes], axis=2)


def realised(Y: Floats) -> Floats:
    """Eigenvalues of a minimal realisation with the impulse responses Y (samples, outputs, inputs).

    Ho and Kalman 1966, with the singular value decomposition of Juang and Pappa 1985.
    """
    rows = len(Y) // 2
    H = np.block([[Y[i + j] for j in range(len(Y) - rows)] for i in range(rows)])
    U, s, _ = np.linalg.svd(H, full_matrices=False)
    rank = max(1, int((s > _NOISE * s[0]).sum()))
    observability = U[:, :rank] * np.sqrt(s[:rank])
    outputs = Y.shape[1]
    A = np.linalg.lstsq(observability[:-outputs], observability[outputs:], rcond=None)[0]
    return np.asarray(np.linalg.eigvals(A))


def linearised(body: Body, presses: tuple[Press, ...], delay: float, law: Law) -> Row:
    """`rho` over `SAMPLE`, the rate of its mode [1/s] and frequency [Hz], at an equilibrium."""
    session = joined(body, presses, delay, Law.PREDICTIVE)
    with replaced(contact, _KEEP_DISTANCE=_FINE, _TOLERANCE=_FINE):
        with replaced(contact_tracking, turning_lag=lambda *_: _SLOW):
            session.run(_APPROACH + 2.0 * delay + 12.0)
        if law is not Law.PREDICTIVE:
            for name in session.users:
                session.set_law(name, law)
            session.run(1.0 + 4.0 * delay)
        drift = max(float(np.ptp(user.force[-1000:])) for user in session.users.values())
        Y = responses(session, 5.0 + 10.0 * delay)
    roots = realised(Y[round((0.5 + 2.0 * delay) / SAMPLE) :])
    size = np.linalg.norm(Y, axis=(1, 2))
    late = slice(len(size) // 2, None)
    trend = np.polyfit(SAMPLE * np.arange(len(size))[late], np.log(size[late]), 1)[0]
    root = roots[np.argmax(np.abs(roots))]
    return {
        "drift_n": drift,
        "rho": float(np.abs(root)),
        "rate_per_s": float(np.log(np.abs(root)) / SAMPLE),
        "trend_per_s": float(trend),
        "frequency_hz": float(np.abs(np.angle(root)) / (2.0 * np.pi * SAMPLE)),
        "slope": [float(user.contact.slope) for user in session.room.world.users.values()],
        "coupling": session.room.world.room.coupling,
        "force_n": [user.force[-1] for user in session.users.values()],
    }


def played(body: Body, presses: tuple[Press, ...], delay: float, law: Law) -> Row:
    """Whether a session of the product comes to rest, and by how much its forces change."""
    session = joined(body, presses, delay, law)
    session.run(_APPROACH + 2.0 * delay + 8.0 + 20.0 * delay)
    force = np.array([user.force[-2000:] for user in session.users.values()])
    ripple = np.ptp(force, axis=1)
    allowed = np.maximum(RIPPLE, RIPPLE_SHARE * force.mean(axis=1))
    return {"rests": bool((ripple <= allowed).all()), "ripple_n": float(ripple.max())}


def _parser() -> ArgumentParser:
    parser = json_report.parser(__doc__)
    parser.add_argument("--limbs", nargs="+", default=list(LIMBS), choices=list(LIMBS))
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(100, 106)))
    parser.add_argument("--delays-ms", nargs="+", type=float, default=[0.0, 20.0, 80.0, 250.0])
    parser.add_argument("--laws", nargs="+", default=["predictive"], choices=[w.value for w in Law])
    parser.add_argument("--only-play", action="store_true", help="no linearisation")
    return parser


def main() -> None:
    """Print a row for each session while it is measured."""
    options = _parser().parse_args()
    rows: list[Row] = []
    print(
        "| limb | seed | law | delay | slopes | m | rho | rate | trend | frequency | drift"
        " | session |"
    )
    print(f"|{'---|' * 12}", flush=True)
    with threadpool_limits(limits=1):
        for name in options.limbs:
            body = LIMBS[name]()
            for seed in options.seeds:
                presses = draw(body, seed)
                for law in map(Law, options.laws):
                    for delay in (1e-3 * ms for ms in options.delays_ms):
                        row: Row = {"limb": name, "seed": seed, "law": law.value, "delay_s": delay}
                        row |= played(body, presses, delay, law)
                        if not options.only_play:
                            row |= linearised(body, presses, delay, law)
                        rows.append(row)
                        print(_line(row), flush=True)
    json_report.write(options, rows)
    swing = sum(not row["rests"] for row in rows)
    print(f"\n{len(rows)} sessions: {swing} do not rest")


def _line(row: Row) -> str:
    cells = [row["limb"], str(row["seed"]), row["law"], f"{1e3 * row['delay_s']:.0f} ms"]
    if "rho" in row:
        cells += [" ".join(f"{slope:.2f}" for slope in row["slope"]), f"{row['coupling']:.2f}"]
        still = row["drift_n"] <= STILL
        cells += [f"{row['rho']:.3f}" if still else "no equilibrium"]
        cells += [f"{row['rate_per_s']:+.2f} /s", f"{row['trend_per_s']:+.2f} /s"]
        cells += [f"{row['frequency_hz']:.2f} Hz", f"{row['drift_n']:.4f} N"]
    else:
        cells += [""] * 7
    cells.append(("rests" if row["rests"] else "swings") + f", {row['ripple_n']:.3f} N")
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
