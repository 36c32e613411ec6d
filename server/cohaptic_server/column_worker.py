"""A thread that finds the columns a solid wants, beside the tick and behind it in rank.

The newest wish wins: after each batch it looks again at what is wanted now, so that it never works
through places that a finger has left long ago.
"""

from __future__ import annotations

import threading

from cohaptic.scheduling import stand_back
from cohaptic_server.bodies.solid import Solid

BATCH = 24  # vertices in one solve; a fingertip covers so many on a mesh that resolves it
_PAUSE = 0.004  # s between two looks at what is wanted


class ColumnWorker:
    """Brings columns to one solid while it is served.

    Args:
        body: It answers from its coarse twin from now on until columns come.
    """

    def __init__(self, body: Solid) -> None:
        body.in_background()
        self._body = body
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._work, name="columns", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End after the batch at hand."""
        self._stop.set()
        self._thread.join()

    def _work(self) -> None:
        stand_back()
        while not self._stop.is_set():
            # Until a tick has taken what was brought, the list of wishes is an old one.
            found = [] if self._body.waiting else self._body.find(BATCH)
            self._body.bring(found)
            if not found:
                self._stop.wait(_PAUSE)
