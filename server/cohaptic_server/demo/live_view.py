"""The live view of a demonstration: what each user feels now, and has felt in the last seconds."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from cohaptic.status.report import TouchStatus
from cohaptic.status.table import status_view
from cohaptic_server.demo.scene import DRAG, Scene

TRACE = 60  # readings of a force in the picture of the last seconds
_BLOCKS = "▁▂▃▄▅▆▇█"
_TOP, _TOP_ALONG = 6.0, 2.0  # N at the top of the picture


def traced(scene: Scene, status: TouchStatus) -> float:
    """The force that the picture of the last seconds is of [N]."""
    return (status.along or 0.0) if scene.drags else status.force


def picture(
    scene: Scene,
    statuses: Sequence[TouchStatus],
    traces: Mapping[str, deque[float]],
    since: float | None,
    width: int,
    *,
    every: float,
) -> Group:
    """The live view.

    Args:
        scene: That is shown.
        statuses: What each user says of itself.
        traces: The last readings of each user's force.
        since: Time since everybody is there; None before [s].
        width: Of the terminal [characters].
        every: Time between two readings [s].
    """
    head = Text.assemble(
        (scene.names[0], "bold"),
        f" {_does(scene)} ",
        (f"{scene.law.value} law, {1e3 * scene.delay:g} ms each way", "bold"),
        f", {scene.simulation_hz:g} Hz. {_progress(scene, since)}",
    )
    top = _TOP_ALONG if scene.drags else _TOP
    lines = Table(box=None, pad_edge=False, show_header=False)
    for name, forces in traces.items():
        lines.add_row(name, Text(sparkline(forces, top), style="cyan"))
    what = "force along the surface" if scene.drags else "force"
    legend = f"{what} over the last {TRACE * every:.0f} s, up to {top:g} N"
    return Group(head, "", status_view(statuses, width=width), Text(legend, style="dim"), lines)


def _does(scene: Scene) -> str:
    """What the first hand does, and the others."""
    every = f"every {scene.rhythm.period:.1f} s"
    if scene.drags:
        way = f"drags {1e3 * DRAG:g} mm along the surface and back"
        return f"presses, then {way} {every}; {scene.names[1]} sticks beside it."
    return f"presses and lets go {every}, the others rest."


def _progress(scene: Scene, since: float | None) -> str:
    if since is None:
        return "everybody comes ..."
    if scene.duration is None:
        return f"{since:.0f} s; Ctrl-C for the result"
    return f"{since:.0f} of {scene.duration:g} s"


def sparkline(values: deque[float], top: float = _TOP) -> str:
    """Forces as blocks of growing height.

    Args:
        values: Shape (n,) [N].
        top: Of the highest block [N].
    """
    highest = len(_BLOCKS) - 1
    return "".join(_BLOCKS[min(highest, max(0, round(highest * v / top)))] for v in values)
