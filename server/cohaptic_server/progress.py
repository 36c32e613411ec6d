"""Progress of a long preparation, as it is reported to whoever waits."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]  # name of the phase, and the share of it that is done
