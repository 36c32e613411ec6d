"""Hands whose clients move models of each other: forces at rest, comers and goers, and a press."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.frame import MAX_FORCE
from cohaptic.protocol.messages import Hello
from cohaptic.protocol.partners import HEAVIEST, LIGHTEST
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.simulated.hand import HandScript, Intention
from cohaptic.vec import Vec3, add, scale
from cohaptic_client.loop.safety import EXTERNAL_RATE
from cohaptic_experiments.virtual_session import PERIOD, VirtualSession
from cohaptic_server.bodies.balloon.balloon import Balloon
from cohaptic_server.numeric import Floats
from cohaptic_server.room.body_frames import describe
from cohaptic_server.world.equilibrium import RestingHand, solve

NIGHT = pytest.mark.night
# s, one way. By day each test plays one of them; each session is played for ten seconds and more.
DELAYS = (pytest.param(0.0, marks=NIGHT), 0.08, pytest.param(0.25, marks=NIGHT))
DEPTH = 0.01  # m
BESIDE = 0.3 * math.pi  # of the third hand, which the first feels well
STEP = EXTERNAL_RATE * PERIOD  # N
ROUNDING = 1e-6  # N
PRESSES, FURTHER = 3.5, 0.005  # s and m, of a press


def script(angle: float, approach_at: float = 1.0, depth: float = DEPTH) -> HandScript:
    return HandScript(angle, depth=depth, approach_at=approach_at)


# What a client does: it moves models of the others, or tells its own hand as the page does, or
# neither.
MOVES, TELLS, NEITHER = "moves models", "tells its hand", "neither"


def two(body: Balloon, delay: float, other: str = MOVES) -> VirtualSession:
    """Two hands with models, on opposite sides of the balloon."""
    session = VirtualSession(body)
    session.join("user0", script(0.0), delay=delay, models=True)
    session.join(
        "user1",
        script(math.pi),
        delay=delay,
        seed=1,
        models=other == MOVES,
        tells_hand=other == TELLS,
    )
    return session


def at_rest(body: Balloon, scripts: list[HandScript]) -> Floats:
    """Forces at which these hands rest [N]."""
    info = describe(body)
    hands = [
        RestingHand(s.intention(info.center, info.radius).tip(1.0), s.hand.stiffness)
        for s in scripts
    ]
    return solve(body, hands).force


def weight_of(session: VirtualSession) -> float:
    return session.room.world.wishes.weight


@pytest.mark.parametrize("other", [MOVES, TELLS])
@pytest.mark.parametrize("delay", [0.0, 0.25])
def test_forces_come_to_the_equilibrium(small_balloon: Balloon, delay: float, other: str) -> None:
    session = two(small_balloon, delay, other)
    session.run(3.5 + 8.0 * delay)
    expected = at_rest(small_balloon, [script(0.0), script(math.pi)])
    for user, force in zip(session.users.values(), expected, strict=True):
        assert user.force[-1] == pytest.approx(force, rel=0.01)
        assert np.ptp(user.force[-300:]) < 0.01 * force
        assert max(user.unexplained) <= STEP + ROUNDING
    assert weight_of(session) == 1.0


def join_who(other: str) -> Callable[[VirtualSession, float], None]:
    def act(session: VirtualSession, delay: float) -> None:
        comer = script(BESIDE, 0.3, 0.02)
        session.join(
            "third", comer, delay=delay, seed=7, models=other == MOVES, tells_hand=other == TELLS
        )

    return act


def leave(session: VirtualSession, _: float) -> None:
    session.drop("user1")


def mute(session: VirtualSession, _: float) -> None:
    session.users["user1"].talking = False


EVENTS = {
    "one who moves models joins": join_who(MOVES),
    "one who tells its hand joins": join_who(TELLS),
    "one without joins": join_who(NEITHER),
    "one leaves": leave,
    "one falls silent": mute,
}


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("event", EVENTS)
def test_no_comer_or_goer_makes_a_force_jump(
    small_balloon: Balloon, event: str, delay: float
) -> None:
    session = two(small_balloon, delay)
    session.run(3.0 + 4.0 * delay)
    staying = session.users["user0"]
    before, weight = staying.force[-1], weight_of(session)
    EVENTS[event](session, delay)
    session.run(3.0 + 4.0 * delay)
    assert abs(staying.force[-1] - before) > 0.02 * before
    assert weight == 1.0
    assert weight_of(session) == (0.0 if event == "one without joins" else 1.0)
    for user in session.users.values():
        assert max(user.unexplained) <= STEP + ROUNDING


@pytest.mark.parametrize("delay", DELAYS)
def test_one_who_is_muted_makes_no_force_jump_and_forbids_nothing(
    small_balloon: Balloon, delay: float
) -> None:
    session = two(small_balloon, delay)
    join_who(NEITHER)(session, delay)
    session.run(3.5 + 4.0 * delay)
    assert weight_of(session) == 0.0
    session.room.members[session.users["third"].number].muted = True
    session.run(4.5 + 4.0 * delay)
    assert weight_of(session) == 1.0
    for name in ("user0", "user1"):
        assert max(session.users[name].unexplained) <= STEP + ROUNDING


class Further(Intention):
    """A hand that at once wants to be deeper, some time after its approach began."""

    __slots__ = ()

    def position(self, t: float) -> Vec3:
        further = FURTHER if t > PRESSES + self.approach_at - 1.0 else 0.0
        return add(super().position(t), scale(self.direction, further))


def press_of_another(
    body: Balloon,
    delay: float,
    other: str = MOVES,
    joins: Callable[[VirtualSession, HandScript], object] | None = None,
) -> Floats:
    """Change of the force on a resting hand from when another one wants to be deeper on [N].

    Args:
        delay: Each way [s].
        other: Part in models of the client of that hand.
        joins: Lets a third hand join, which approaches with these two.
    """
    session = VirtualSession(body)
    info = describe(body)
    resting = session.join("resting", script(0.0), delay=delay, models=True)
    presses = PRESSES + 4.0 * delay
    path = Further(
        add(info.center, (-info.radius, 0.0, 0.0)), (1.0, 0.0, 0.0), DEPTH,
        approach_at=1.0 + 4.0 * delay,
    )  # fmt: skip
    session.join(
        "other", script(math.pi), delay=delay, seed=1, intention=path, models=other == MOVES,
        tells_hand=other == TELLS,
    )  # fmt: skip
    if joins is not None:
        joins(session, script(BESIDE))
    session.run(presses)
    before = resting.force[-1]
    session.run(2.0 + 4.0 * delay)
    return np.array(resting.force[round(presses / PERIOD) :]) - before


def reached(change: Floats) -> float:
    """Time until nine tenths of a change [s]."""
    return PERIOD * float(np.argmax(change >= 0.9 * change[-1]))


@pytest.mark.parametrize("other", [MOVES, TELLS])
@pytest.mark.parametrize("delay", DELAYS)
def test_a_press_of_another_is_felt_after_both_ways_and_little_more(
    small_balloon: Balloon, delay: float, other: str
) -> None:
    change = press_of_another(small_balloon, delay, other)
    assert change[-1] > 0.1
    assert reached(change) <= 2.0 * delay + 0.12


@pytest.mark.parametrize("delay", DELAYS)
def test_who_hovers_on_a_device_that_damps_nothing_costs_the_others_nothing(
    small_balloon: Balloon, delay: float
) -> None:
    def hover(session: VirtualSession, script: HandScript) -> None:
        info = describe(small_balloon)
        path = script.intention(info.center, info.radius)
        above = replace(path, surface=add(path.surface, scale(path.direction, -2.0 * DEPTH)))
        session.join("third", script, intention=above, delay=0.3, max_damping=0.0)

    alone = press_of_another(small_balloon, delay)
    beside = press_of_another(small_balloon, delay, joins=hover)
    assert np.abs(beside - alone).max() <= 1e-3 * alone.max()


@pytest.mark.parametrize("delay", DELAYS)
def test_who_presses_on_a_device_that_damps_nothing_costs_the_others_a_third_at_most(
    small_balloon: Balloon, delay: float
) -> None:
    """Beside one whose device damps; -3 dB is the reciprocal of such a time."""

    def press(damping: float) -> Callable[[VirtualSession, HandScript], object]:
        return lambda session, script: session.join(
            "third", script, delay=delay, seed=7, max_damping=damping, models=True
        )

    damped, bare = [
        reached(press_of_another(small_balloon, delay, joins=press(damping))) - 2.0 * delay
        for damping in (8.0, 0.0)
    ]
    assert bare <= 4.0 / 3.0 * damped


MAX_IN_A_PERIOD, MAX_IN_20_MS = 0.1, 1.5  # N, on the hand of a victim, as in test_hostile_users
TOUCHED, ABOVE = 0.095, 0.106  # m from the middle of the balloon
Reported = tuple[float, float, float, float]  # distance [m], force [N], give [m], time [s]
ATTACKS: dict[str, Callable[[int], Reported]] = {
    "a deflection that swings": lambda k: (TOUCHED, 3.0, 10.0 * (-1.0) ** k, k / 60.0),
    "a deflection that comes and goes": lambda k: (TOUCHED, 3.0, 0.5 * (k // 30 % 2), k / 60.0),
    "a give in the air": lambda k: (ABOVE, 0.0, 10.0 * (k // 60 % 2), k / 60.0),
    "a deflection that comes from out of reach": lambda k: (
        (ABOVE, 0.2)[k // 30 % 2], 0.0, (-10.0, 10.0)[k // 60 % 2], k / 60.0,
    ),
    "times without a step": lambda k: (
        TOUCHED, 3.0 + k % 3, 0.0, 5e-324 * k if k < 60 else (k - 60) / 5.0,
    ),
}  # fmt: skip


OUT = (math.cos(BESIDE), math.sin(BESIDE), 0.0)  # towards the attacker


def attacked(body: Balloon, *, models: bool) -> tuple[VirtualSession, int]:
    """Two hands at rest that move models, and the number of an attacker who has joined them."""
    session = two(body, 0.01)
    session.run(3.0)
    hello = Hello(
        protocol=PROTOCOL_VERSION, name="bad", max_force=MAX_FORCE, max_stiffness=1e6,
        models=models,
    )  # fmt: skip
    return session, session.room.join(hello, session.now)[0].user


@pytest.mark.parametrize(
    "changing",
    [None, pytest.param(1, marks=NIGHT), 30],
    ids=["moves", "flickers", "changes"],
)
@pytest.mark.parametrize("attack", ATTACKS)
def test_what_others_tell_of_themselves_is_little_felt(
    small_balloon: Balloon, attack: str, changing: int | None
) -> None:
    """By one who rests and moves models of them; nobody is expelled, and no tick fails.

    The attacker says that it moves models, or that it simulates its hand, which it makes another
    every `changing` samples.
    """
    session, number = attacked(small_balloon, models=changing is None)
    for k in range(300):
        distance, force, deflection, t = ATTACKS[attack](k)
        own_model = None if changing is None else (LIGHTEST, HEAVIEST)[k // changing % 2]
        reported = ContactSample(
            k + 1, session.room.world.tick, t, scale(OUT, distance), scale(OUT, force),
            deflection=deflection, own_model=own_model,
        )  # fmt: skip
        session.room.sample(number, ContactSample.decode(reported.encode()), session.now)
        session.run(1.0 / 60.0)
    for user in session.users.values():
        felt = np.array(user.force[3000:])
        assert np.abs(np.diff(felt)).max() <= MAX_IN_A_PERIOD
        assert np.abs(felt[20:] - felt[:-20]).max() <= MAX_IN_20_MS


@pytest.mark.parametrize("changing", [None, 1, 1000], ids=["moves", "flickers", "changed once"])
@pytest.mark.parametrize(
    "distance", [0.085, pytest.param(TOUCHED, marks=NIGHT), 0.0999], ids="{:g} m".format
)
def test_who_tells_no_force_is_felt_with_a_newton_at_most(
    small_balloon: Balloon, distance: float, changing: int | None
) -> None:
    """However deep it says to be, and however far its hand to have given way.

    Its model is the heaviest at first, and the lightest later.
    """
    session, number = attacked(small_balloon, models=changing is None)
    for k in range(240):
        own_model = LIGHTEST if k and (changing == 1000 or k % 2) else HEAVIEST
        reported = ContactSample(
            k + 1, session.room.world.tick, k / 60.0, scale(OUT, distance), (0.0, 0.0, 0.0),
            deflection=10.0, own_model=None if changing is None else own_model,
        )  # fmt: skip
        session.room.sample(number, ContactSample.decode(reported.encode()), session.now)
        session.run(1.0 / 60.0)
    assert session.room.world.wishes.weight == 1.0
    for user in session.users.values():
        felt = np.array(user.force)
        assert np.abs(felt[3000:] - felt[2999]).max() <= 1.0
