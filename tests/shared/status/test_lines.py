from __future__ import annotations

from cohaptic.status.report import TouchStatus
from cohaptic.status.table import Summary, status_line

TOUCHING = TouchStatus(
    name="ann", state="touching", force=2.43, felt_from_others=-0.5, indentation=0.0089, k_o=272.0,
    round_trip=0.003, loop_hz=999.6, loop_missed=2,
)  # fmt: skip


def test_a_line_has_force_depth_and_stiffness_while_the_hand_touches() -> None:
    said = "ann: touching, 2.43 N, -0.50 N of others, 8.9 mm deep, K_o 272 N/m"
    assert status_line(TOUCHING) == said
    assert status_line(TouchStatus(name="ann", state="free")) == "ann: free"
    fault = TouchStatus(name="ann", state="fault", fault="too fast")
    assert status_line(fault) == "ann: fault, force off: too fast"


def test_who_was_never_in_has_no_summary_and_who_was_stopped_touched_nothing() -> None:
    summary = Summary(0.0)
    summary.read(TouchStatus(name="ann", state="connecting"), 1.0)
    assert summary.line(2.0) == ""
    summary.read(TOUCHING, 3.0)
    summary.read(TOUCHING, 3603.0)
    assert summary.line(3603.0).startswith("ann: touched for 1 of 3603 s")
