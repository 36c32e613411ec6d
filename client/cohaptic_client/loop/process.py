"""The haptic loop's own process, so that network work cannot delay the loop.

python -m cohaptic_client.loop.process CONFIG
"""

from __future__ import annotations

import sys

from cohaptic import compiled


def main() -> None:
    """Run the haptic loop with the configuration in the command line's first argument."""
    compiled.use("kernels")
    compiled.use("loop")
    # Imported only now, because a module that was imported before `use` stays interpreted.
    from cohaptic_client.loop.running.entry import live

    live(sys.argv[1])


if __name__ == "__main__":
    main()
