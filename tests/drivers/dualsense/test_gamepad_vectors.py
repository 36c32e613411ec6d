"""The golden vectors of the gamepad, which the page's TypeScript is checked against.

`python -m tests.drivers.dualsense.test_gamepad_vectors` writes them again after a change.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path

from cohaptic.vec import Vec3
from cohaptic_drivers.dualsense.cursor import FRONT, Cursor, Room, moved, position, pull_of
from cohaptic_drivers.dualsense.feeling import NOTHING_FELT, felt
from cohaptic_drivers.dualsense.reports import SIDES, SIZE, Effects, Held, decode, encode
from tests.client.loop.test_law_vectors import as_json, assert_close

FILE = Path(__file__).parents[2] / "vectors" / "gamepad.json"
RIGHT = SIDES["right"]
ROOM = Room(FRONT, 0.03, 0.2)
FULL = 3.0
_INWARD: Vec3 = FRONT.inward


def _report(*fields: tuple[int, int], size: int = SIZE, id_: int = 1) -> bytes:
    data = bytearray(b"\x80" * size)
    data[0] = id_
    for at, value in fields:
        data[at] = value
    return bytes(data)


def reports() -> list[object]:
    """Reports of the pad, and what is held by them; null where they are none."""
    given = [
        _report(),
        _report((1, 0), (2, 0), (3, 255), (4, 255), (6, 255)),
        _report((1, 127), (2, 129), (6, 6), (8, 0x28), (9, 0x81), (10, 0xFF)),
        _report(size=63),
        _report(size=10),
        _report(id_=2),
        _report(size=78, id_=1),
    ]
    return [
        {
            "hex": each.hex(),
            "held": None if (reported := decode(each, RIGHT)) is None else asdict(reported),
        }
        for each in given
    ]


def effects() -> list[object]:
    """What is to be felt, and the report with it."""
    given = [Effects(), Effects(90, 200, 0), Effects(0, 1, 255), Effects(300, 999, -7)]
    return [{"effects": asdict(each), "hex": encode(each, RIGHT).hex()} for each in given]


def moves() -> list[object]:
    """A play at stick and trigger: pressed, slammed shut, let go of in contact, pushed inside."""
    cursor, rows = Cursor(base=-0.11), list[object]()
    for k in range(400):
        t = 0.004 * k
        pull = 0 if k < 20 else min(255, 3 * (k - 20)) if k < 120 else 255 if k < 180 else 0
        stick = 1.0 if 220 < k < 390 else -0.05
        held = Held((math.sin(3.0 * t), math.cos(2.0 * t)), (0.0, stick), pull)
        contact = cursor.base + cursor.press > -0.09
        cursor = moved(cursor, held, 0.004, ROOM, contact=contact)
        place = position(cursor, FRONT)
        rows.append(
            {
                "left": held.left,
                "right": held.right,
                "pull": pull,
                "contact": contact,
                "place": place,
                "pull_of": pull_of(cursor, ROOM),
            }
        )
    return rows


def feelings() -> list[object]:
    """A press, a tap, a force sideways, and what cannot be."""
    feeling, rows = NOTHING_FELT, list[object]()
    for k in range(120):
        size = 2.0 * math.sin(0.05 * k) if k < 60 else 5.0 if k == 70 else 0.0101 * k
        force: Vec3 = (0.3 if k > 80 else 0.0, -size, 0.0) if k != 100 else (0.0, 1e9, 0.0)
        pull = 100 + (k % 40)
        feeling = felt(feeling, force, pull=pull, inward=_INWARD, full=FULL, now=0.016 * k)
        rows.append(
            {"force": force, "pull": pull, "now": 0.016 * k, "effects": asdict(feeling.effects)}
        )
    return rows


def vectors() -> dict[str, object]:
    """All of them."""
    return {
        "reports": reports(),
        "effects": effects(),
        "moves": {"depth": ROOM.depth, "reach": ROOM.reach, "dt": 0.004, "rows": moves()},
        "feelings": {"inward": _INWARD, "full": FULL, "rows": feelings()},
    }


def test_the_written_vectors_are_what_the_driver_says() -> None:
    assert_close(json.loads(as_json(vectors())), json.loads(FILE.read_text()), "gamepad")


if __name__ == "__main__":
    FILE.write_text(as_json(vectors()))
