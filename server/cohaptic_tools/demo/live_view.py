"""Shows a demonstration live: the state of each user, and each force over the last seconds."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping, Sequence

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cohaptic.clock import SystemClock
from cohaptic.simulated.networks import in_words
from cohaptic.status.report import TouchStatus
from cohaptic.status.table import EVERY, status_line, status_view
from cohaptic_tools.demo.processes import DemoFailed, Stage
from cohaptic_tools.demo.scene import DRAG, Scene

TRACE = 60  # readings of a force in a sparkline
REFRESH = 0.1  # s between two readings
GATHER = 45.0  # s after the start within which every client must be touching or free
_BLOCKS = "▁▂▃▄▅▆▇█"
_TOP, _TOP_TANGENTIAL = 6.0, 2.0  # N at the top of a sparkline


def watch(
    stage: Stage, scene: Scene, console: Console, stop: threading.Event
) -> tuple[list[TouchStatus], dict[str, set[str]]]:
    """Show the users until the scene's duration is over, or `stop` is set.

    Args:
        stage: The running processes of the scene.
        scene: Scene that the users perform.
        console: Terminal on which the view is shown.
        stop: Event that ends the view.

    Returns:
        The last status of each user, and the faults that switched forces off, by name of the user.

    Raises:
        DemoFailed: A client has ended, or not all clients were engaged within `GATHER`.
    """
    clock = SystemClock()
    monitor, reported = Monitor(scene, clock.now()), clock.now()
    with Live(console=console, refresh_per_second=10, transient=True) as live:
        while not stop.wait(REFRESH):
            now = clock.now()
            monitor.read(stage.statuses(), now)
            if console.is_terminal:
                live.update(monitor.picture(now, console.width))
            elif now - reported >= EVERY and monitor.statuses:
                reported = now
                lines = "; ".join(status_line(user) for user in monitor.statuses)
                console.print(lines, highlight=False, markup=False, soft_wrap=True)
            if monitor.is_over(now):
                break
    return monitor.statuses or stage.statuses(), monitor.faults


class Monitor:
    """Follows the statuses of all users from the start of their processes.

    A user is engaged while its status is "touching" or "free".

    Args:
        scene: Scene that the users perform.
        opened: Time at which the processes were started [s].

    Attributes:
        statuses: Statuses at the last reading; empty before the first.
        faults: Faults since all users were engaged, by name of the user.
        since: Time since which all users have been engaged [s]; None before that.
    """

    def __init__(self, scene: Scene, opened: float) -> None:
        self._scene, self._opened = scene, opened
        self._traces = {name: deque[float](maxlen=TRACE) for name in scene.names}
        self.statuses: list[TouchStatus] = []
        self.faults: dict[str, set[str]] = {}
        self.since: float | None = None

    def read(self, statuses: list[TouchStatus], now: float) -> None:
        """Store one status of every user, and note faults and whether all users are engaged.

        Raises:
            DemoFailed: A client has ended, or not all are engaged `GATHER` after the start.
        """
        self.statuses = statuses
        for status in statuses:
            self._traces[status.name].append(traced(self._scene, status))
            if status.fault and self.since is not None:
                self.faults.setdefault(status.name, set()).add(status.fault)
            if status.state.startswith("gone"):
                raise DemoFailed(f"{status.name} is {status.state}")
        if self.since is not None:
            return
        if all(status.state in ("touching", "free") for status in statuses):
            self.since = now
        elif now - self._opened > GATHER:
            states = ", ".join(f"{status.name} is {status.state}" for status in statuses)
            raise DemoFailed(f"not everybody came within {GATHER:g} s: {states}")

    def is_over(self, now: float) -> bool:
        """Whether the scene's duration has passed since all users were engaged."""
        duration = self._scene.duration
        return self.since is not None and duration is not None and now - self.since >= duration

    def picture(self, now: float, width: int) -> Group:
        """Return a drawing of the last reading, for a terminal of `width` characters."""
        since = None if self.since is None else now - self.since
        return picture(self._scene, self.statuses, self._traces, since, width, every=REFRESH)


def traced(scene: Scene, status: TouchStatus) -> float:
    """Return the force for the sparkline: tangential in a scene with friction, else whole [N]."""
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
    """Return the live view: a headline, a table of the users, a sparkline of each force.

    Args:
        statuses: Last status of each user.
        traces: Last readings of each user's force, by name [N].
        since: Time for which all users have been engaged [s]; None before.
        width: Width of the terminal [characters].
        every: Time between two readings [s].
    """
    head = Text.assemble(
        (scene.names[0], "bold"),
        f" {_action(scene)} ",
        (f"{scene.law.value} law, {in_words(scene.link)}", "bold"),
        f", {scene.simulation_hz:g} Hz. {_progress(scene, since)}",
    )
    top = _TOP_TANGENTIAL if scene.drags else _TOP
    lines = Table(box=None, pad_edge=False, show_header=False)
    for name, forces in traces.items():
        lines.add_row(name, Text(sparkline(forces, top), style="cyan"))
    quantity = "force along the surface" if scene.drags else "force"
    legend = f"{quantity} over the last {TRACE * every:.0f} s, up to {top:g} N"
    return Group(head, "", status_view(statuses, width=width), Text(legend, style="dim"), lines)


def _action(scene: Scene) -> str:
    """Return in words what the first hand and the other hands do."""
    every = f"every {scene.rhythm.period:.1f} s"
    if scene.drags:
        action = f"drags {1e3 * DRAG:g} mm along the surface and back"
        return f"presses, then {action} {every}; {scene.names[1]} sticks beside it."
    return f"presses and lets go {every}, the others rest."


def _progress(scene: Scene, since: float | None) -> str:
    if since is None:
        return "everybody comes ..."
    if scene.duration is None:
        return f"{since:.0f} s; Ctrl-C for the result"
    return f"{since:.0f} of {scene.duration:g} s"


def sparkline(values: deque[float], top: float = _TOP) -> str:
    """Return forces as a line of block characters, whose heights show the forces.

    Args:
        values: Forces, shape (n,) [N].
        top: Force of the highest block [N].
    """
    highest = len(_BLOCKS) - 1
    return "".join(_BLOCKS[min(highest, max(0, round(highest * v / top)))] for v in values)
