"""Values of all options of an object, as they are given, for tests that take them elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hypothesis import strategies as st

_NAMES = st.text(min_size=1, max_size=8).filter(lambda name: name == name.strip())


@st.composite
def _of_parts(draw: st.DrawFn, low: float, high: float) -> list[str]:
    """Texts with a number for the object or none, and with numbers for some of its parts."""
    number = st.floats(low, high)
    parts = draw(st.dictionaries(_NAMES, number, max_size=3))
    own = [repr(value) for value in draw(st.lists(number, max_size=1))]
    return own + [f"{name}={value!r}" for name, value in parts.items()]


_EACH: dict[str, st.SearchStrategy[Any]] = {
    "young": _of_parts(10.0, 1e12),
    "poisson": _of_parts(0.0, 0.499),
    "fix": st.text(max_size=12),
    "fix_mesh": st.sampled_from(
        [Path("held.stl"), Path("a folder/-b=c.stl"), Path("12:30.stl:cm:LPS")]
    ),
    "scale": st.floats(1e-9, 1e9),
    "edge": st.floats(0.005, 0.5),
    "order": st.sampled_from([1, 2]),
    "contact_radius": st.just(0.0) | st.floats(1e-4, 0.5),
    "repair": st.booleans(),
    "simplify": st.just(0) | st.integers(100, 300_000),
    "shell": st.just(0.0) | st.floats(1e-4, 1.0),
    "max_memory": st.floats(0.5, 1e4),
    "max_time": st.floats(1.0, 1e6),
    "label": st.lists(st.text(max_size=8), max_size=3),
    "density": _of_parts(1.0, 3e4),
    "damping_ratio": st.floats(0.02, 0.95),
}
GIVEN = st.fixed_dictionaries({}, optional=_EACH)
