"""Step 1: serve a soft object, and touch it with the mouse.

python examples/step_1_serve.py

Open the address that it prints in a browser, choose *Touch it* and press on the balloon; open it
in a second window, too, and feel one hand with the other. Ctrl-C ends it.
"""

from __future__ import annotations

import sys

from cohaptic_server import serve

port = int(sys.argv[1]) if len(sys.argv) > 1 else 8765

with serve("balloon", port=port) as room:
    print(f"open {room.page}, or join {room.url}", flush=True)
    present = set[str]()
    while room.wait(0.5):
        users = {user.name for user in room.users}
        for name in users - present:
            print(f"{name} joined", flush=True)
        for name in present - users:
            print(f"{name} left", flush=True)
        present = users
