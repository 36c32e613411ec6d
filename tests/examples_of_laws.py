"""How often a law is tried that needs another number of examples than the profile's."""

from __future__ import annotations

import os

# By profile of `tests/conftest.py`: a fifth by day, where laws are there to be run often.
_FRACTION = {"quick": 0.2, "deep": 10.0}[os.environ.get("HYPOTHESIS_PROFILE", "quick")]


def examples(usual: int) -> int:
    """Examples of a law that would be tried on `usual` of them, where hypothesis tries 100."""
    return max(min(5, usual), round(_FRACTION * usual))
