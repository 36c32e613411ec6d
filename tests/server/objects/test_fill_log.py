from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.objects.fill_process import FillLog

PASS = ["edge splitting done!", "edge collapsing done!", "edge swapping done!"]
LINES = [
    "bbox_diag_length = 0.245561",
    "collapsing 0.126907",
    "[float-tetwild] [info] triangle insertion start, #f = 2952, #v = 2812, #t = 15242",
    "[float-tetwild] [info] mark_surface_fs done",
    "initializing...",
    "edge collapsing done!",
    *[line for k in range(4) for line in (f"//////////////// pass {k} ////////////////", *PASS)],
    "//////////////// postprocessing ////////////////",
    "edge collapsing done!",
    "Tetrahedralization completed. Extracting mesh data...",
]


@given(st.lists(st.sampled_from([*LINES, "", "success = 3(8355)", "nonsense"]), max_size=400))
def test_whatever_it_prints_the_share_never_falls_and_never_ends_before_the_end(
    lines: list[str],
) -> None:
    log = FillLog()
    fractions = [log.read(line) for line in lines]
    assert fractions == sorted(fractions)
    assert all(0.0 <= fraction < 1.0 for fraction in fractions)
