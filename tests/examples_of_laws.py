"""How often a law is tried that needs another number of examples than the profile's."""

from __future__ import annotations

import os

# By profile of `tests/conftest.py`: in the quick one laws are there to be run often.
_SHARE = {"quick": 0.2, "usual": 1.0, "deep": 10.0}[os.environ.get("HYPOTHESIS_PROFILE", "quick")]


def examples(by_day: int) -> int:
    """Examples of a law that is tried on `by_day` of them in `make test-all`."""
    return max(min(5, by_day), round(_SHARE * by_day))
