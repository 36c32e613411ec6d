"""Rooms of hands with friction on a soft block: which come to rest, and the largest step.

    python benchmarks/friction_rooms.py [--rooms 40] [--seed 0] [--friction MU ...] [--json F]

One to three hands press 3 to 8 mm deep at random vertices of a block of 60 x 60 x 120 mm and 6 kPa
that stands on its base, edges and corners among them, each with one of these coefficients of
friction and 0, 40, 100 or 200 ms each way; every second room has mesh patches. All in virtual time.
A room rests where no force changes by more than 1 % in the last two of its seconds; its step is the
largest change of a force in a millisecond that the hand's own motion does not explain, at most 0.02
N (science 3.9). Forces below 0.05 N count as that much. `--friction 0` is the same without.

What a thin soft block does at its edges is the hardest that we know: a hand of 0.3 N bends it by
several millimetres, and the normal turns by 45 degrees in a few.
"""

from __future__ import annotations

from argparse import ArgumentParser
from dataclasses import asdict, dataclass

import numpy as np

import json_report
from cohaptic.protocol.messages import GeometryName
from cohaptic.simulated.hand import HandScript, Place
from cohaptic_experiments.virtual_session import VirtualSession, VirtualUser
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.numeric import vec3
from cohaptic_server.testing.blocks import block

DELAYS = (0.0, 0.04, 0.1, 0.2)  # s, one way
SHALLOWEST, DEEPEST = 0.003, 0.008  # m
ABOVE = 0.03  # m over the base that is held
SMALLEST = 0.05  # N
STILL = 0.01  # of a force
AT_REST = 2000  # periods of 1 ms
PRESSED = 1500  # by when the first hand presses


@dataclass(frozen=True)
class Room:
    """What a room came to.

    Args:
        number: Number of it.
        hands: How many.
        mesh: Whether they had mesh patches.
        force: At the end, of the hand whose force changes most [N].
        swing: Its largest change at the end, over the force.
        step: Largest unexplained change of a force in a millisecond [N].
    """

    number: int
    hands: int
    mesh: bool
    force: float
    swing: float
    step: float


def soft_block() -> Solid:
    """60 x 60 x 120 mm, held at its base."""
    mesh = block((0.06, 0.06, 0.12), (3, 3, 6))
    return Solid(mesh, mesh.vertices[:, 2] <= 0.0, SolidSettings(6e3, 0.45, 0.012))


def play(body: Solid, seed: int, number: int, friction: tuple[float, ...], time: float) -> Room:
    """One room.

    Args:
        body: That is pressed.
        seed: Seed of all rooms.
        number: Number of this one.
        friction: Coefficients that a hand may have.
        time: How long [s].
    """
    random = np.random.default_rng([seed, number])
    mesh = body.mesh
    free = np.flatnonzero(mesh.vertices[:, 2] > ABOVE)
    session, meshed = VirtualSession(body), number % 2 == 1
    users: list[VirtualUser] = []
    for i in range(int(random.integers(1, 4))):
        k = int(random.choice(free))
        place = Place(vec3(mesh.vertices[k]), vec3(-mesh.normals[k]))
        depth = float(random.uniform(SHALLOWEST, DEEPEST))
        script = HandScript(depth=depth, approach_at=1.2 + 0.3 * i, place=place)
        mu, delay = float(random.choice(friction)), float(random.choice(DELAYS))
        geometry: GeometryName = "mesh" if meshed else "plane"
        users.append(
            session.join(f"hand {i}", script, delay=delay, geometry=geometry, friction=mu, seed=i)
        )
    session.run(time)
    ends = [np.array(user.force[-AT_REST:]) for user in users]
    swings = [float(np.ptp(end)) / max(float(end[-1]), SMALLEST) for end in ends]
    worst = int(np.argmax(swings))
    step = max(max(user.unexplained[PRESSED:]) for user in users)
    return Room(number, len(users), meshed, float(ends[worst][-1]), swings[worst], step)


def _parser() -> ArgumentParser:
    parser = json_report.parser(__doc__)
    parser.add_argument("--rooms", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--friction", type=float, nargs="+", default=[0.1, 0.2, 0.5, 1.0])
    parser.add_argument("--seconds", type=float, default=9.0, help="of a room")
    return parser


def main() -> None:
    """Print a line for each room that does not rest, and the counts."""
    options = _parser().parse_args()
    body, rooms = soft_block(), list[Room]()
    for number in range(options.rooms):
        room = play(body, options.seed, number, tuple(options.friction), options.seconds)
        rooms.append(room)
        if room.swing > STILL:
            patches = "mesh" if room.mesh else "plane"
            moves = f"{room.force:.2f} N moves by {100.0 * room.swing:.0f} %"
            print(f"room {number}: {room.hands} hands, {patches}: {moves}", flush=True)
        json_report.write(options, [asdict(each) for each in rooms])
    moving = sum(room.swing > STILL for room in rooms)
    much = sum(room.swing > 5 * STILL for room in rooms)
    print(
        f"{len(rooms)} rooms: {moving} not at rest after {options.seconds:g} s, {much} by more than"
        f" 5 %; largest step {1e3 * max(room.step for room in rooms):.1f} mN in a millisecond"
    )


if __name__ == "__main__":
    main()
