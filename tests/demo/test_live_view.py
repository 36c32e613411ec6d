from __future__ import annotations

from collections import deque

import pytest
from rich.console import Console

from cohaptic.status.report import TouchStatus
from cohaptic_tools.demo.live_view import GATHER, TRACE, Monitor, picture, traced
from cohaptic_tools.demo.processes import DemoFailed
from cohaptic_tools.demo.scene import Scene

STATUSES = [
    TouchStatus(name="left", state="touching", force=4.0, along=1.5, lag=0.16, k_o=250.0),
    TouchStatus(name="right", state="touching", force=3.0, along=0.6, lag=0.16, k_o=5000.0,
                max_stiffness=2000.0, law="predictive"),
]  # fmt: skip


def shown(scene: Scene, since: float | None, width: int) -> str:
    console = Console(width=width)
    statuses = STATUSES if scene.drags else [s.model_copy(update={"along": None}) for s in STATUSES]
    traces = {s.name: deque([traced(scene, s)] * 3, maxlen=TRACE) for s in statuses}
    with console.capture() as capture:
        console.print(picture(scene, statuses, traces, since, width, every=0.1))
    return " ".join(capture.get().split())


@pytest.mark.parametrize("width", [80, 100, 120, 160])
def test_it_says_what_is_going_on_at_every_width(width: int) -> None:
    text = shown(Scene(duration=12.0), 3.2, width)
    assert "left presses and lets go every" in text
    assert "predictive law, 80 ms each way" in text
    assert "3 of 12 s" in text
    assert "force over the last 6 s, up to 6 N" in text
    assert "right: device renders 2,000 of 5,000 N/m" in text
    assert "the object answers the others in 0.16 s" in text
    assert "…" not in text


def read(monitor: Monitor, now: float, *states: str, fault: str = "") -> None:
    names = ("left", "right")
    statuses = [
        TouchStatus(name=name, state=state, force=1.0)
        for name, state in zip(names, states, strict=True)
    ]
    statuses[1] = statuses[1].model_copy(update={"fault": fault})
    monitor.read(statuses, now)


def test_a_client_that_ends_or_does_not_come_ends_the_demonstration() -> None:
    with pytest.raises(DemoFailed, match="right is gone: no server"):
        read(Monitor(Scene(), 0.0), 1.0, "free", "gone: no server")
    late = "not everybody came within 45 s: left is free, right is connecting"
    monitor = Monitor(Scene(), 0.0)
    read(monitor, GATHER, "free", "connecting")
    with pytest.raises(DemoFailed, match=late):
        read(monitor, GATHER + 0.1, "free", "connecting")
