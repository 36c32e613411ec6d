"""The haptic loop's process: one of its own, so that nothing of the network can delay it.

python -m cohaptic_client.loop.process CONFIG
"""

from __future__ import annotations

import sys

from cohaptic import compiled


def main() -> None:
    """Entry point of the process."""
    compiled.use("kernels")
    compiled.use("loop")
    # Only now: a module that was imported before stays plain.
    from cohaptic_client.loop.running.entry import live

    live(sys.argv[1])


if __name__ == "__main__":
    main()
