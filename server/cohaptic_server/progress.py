"""How a long preparation tells how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]  # a phase, and the share of it that is done
