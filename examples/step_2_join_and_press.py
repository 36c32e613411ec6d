"""Step 2: join a room from a script, press on the object, and ask why the force is as it is.

python examples/step_2_join_and_press.py [ws://127.0.0.1:8765]

Without an address it serves a balloon itself. Positions are in metres and forces in newtons.
"""

from __future__ import annotations

import contextlib
import sys
import time

from cohaptic_client import joined
from cohaptic_server import serve

with contextlib.ExitStack() as stack:
    if len(sys.argv) > 1:
        url = sys.argv[1]
    else:
        url = stack.enter_context(serve("balloon", port=0)).url
    # A tip begins outside the body, on the side where it is to press: it moves in straight lines.
    hand = stack.enter_context(joined(url, name="ann", tip=(0.0, 0.0, 0.12)))

    x, y, z = hand.body.center
    top = z + hand.body.radius
    time.sleep(1.0)  # a hand that has just come gets its force within a second
    hand.move_to((x, y, top - 0.01), seconds=1.0)  # 1 cm into the body; does not wait
    for _ in range(4):
        time.sleep(0.5)
        print(f"tip {1e3 * hand.tip[2]:6.1f} mm   force {hand.force[2]:5.2f} N")
    print(f"{hand.sample.felt_from_others:.2f} N of it since others touch")

    print(f"K_o {hand.patch.k_o:.0f} N/m, others {[other.name for other in hand.others]}")
    print(hand.why.sentence)
    for event in hand.events.new():
        print(f"{event.kind}: {event}")
