"""`cohaptic demo`."""

from __future__ import annotations

import contextlib
import signal
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Generator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cohaptic.clock import SystemClock
from cohaptic.control.law import Law
from cohaptic.report import TouchStatus
from cohaptic.view import status_table
from cohaptic_server.bodies.catalogue import build_body
from cohaptic_server.demo.browser import open_page
from cohaptic_server.demo.processes import DemoFailed, Stage
from cohaptic_server.demo.scene import Scene
from cohaptic_server.demo.summary import evaluate, show
from cohaptic_server.listener import page_address

_REFRESH = 0.1  # s
_GATHER = 45.0  # s for every client to be there and engaged
_WITHOUT_TERMINAL = 15.0  # s
_TRACE = 60  # readings of a force in the picture of the last seconds
_BLOCKS = "▁▂▃▄▅▆▇█"
_TOP = 6.0  # N at the top of the picture


def demo(
    duration: Annotated[
        float | None,
        typer.Option(help="Seconds.", show_default="until Ctrl-C; 15 without a terminal"),
    ] = None,
    users: Annotated[int, typer.Option(help="Hands round the balloon, 2 to 16.")] = 2,
    delay_ms: Annotated[float, typer.Option(help="Injected delay, one way, both ways.")] = 80.0,
    jitter_ms: Annotated[float, typer.Option(help="Largest extra delay, one way.")] = 0.0,
    law: Annotated[Law, typer.Option(help="Local model.")] = Law.PREDICTIVE,
    simulation_hz: Annotated[float, typer.Option(help="Ticks per second, 10 to 200.")] = 60.0,
    seed: Annotated[int, typer.Option(help="Of the jitter.")] = 0,
    json: Annotated[Path | None, typer.Option(help="Write the result to this file.")] = None,
    keep: Annotated[
        Path | None, typer.Option(help="Keep recordings and logs in this folder.")
    ] = None,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Do not open the page, only say where it is.")
    ] = False,
) -> None:
    """Watch users feel each other on a balloon, over a network with delay.

    A server and simulated users run as separate processes on this machine. The first user presses
    and releases; the others rest round the balloon and feel it. At the end the forces are compared
    with the truth: body and hands in equilibrium, without any network.
    """
    console = Console()
    if duration is None and not console.is_terminal:
        duration = _WITHOUT_TERMINAL
    scene = Scene(users, 1e-3 * delay_ms, 1e-3 * jitter_ms, law, simulation_hz, seed, duration)
    if json is not None and not json.resolve().parent.is_dir():
        raise DemoFailed(f"--json {json}: there is no folder {json.resolve().parent}")
    with _folder(keep) as folder:
        stage = Stage(scene, folder)
        stop = _stop_on_interrupt()
        with stage:
            address = page_address(stage.url)
            console.print(f"page {address}", highlight=False)
            if console.is_terminal and not no_browser:
                open_page(address)
            statuses, faults = _watch(stage, scene, console, stop)
        with console.status("comparing with the truth"):
            recordings = [stage.recording(name) for name in scene.names]
            missing = [path.stem for path in recordings if not path.exists()]
            if missing:
                words = "; ".join(f"{name}: {stage.users[name].words()}" for name in missing)
                raise DemoFailed(f"no recording of {', '.join(missing)} ({words})")
            result = evaluate(scene, build_body("balloon"), recordings, statuses, faults)
    console.print(show(result))
    if json is not None:
        json.write_text(result.model_dump_json(indent=2) + "\n")
        console.print(f"written to {json}", highlight=False)
    if any(user.stable is False for user in result.users):
        sys.exit(1)


@contextlib.contextmanager
def _folder(keep: Path | None) -> Generator[Path, None, None]:
    """Where recordings and logs go: a folder to keep, or one that is gone afterwards."""
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        yield keep
        return
    with tempfile.TemporaryDirectory(prefix="cohaptic-demo-") as folder:
        yield Path(folder)


def _stop_on_interrupt() -> threading.Event:
    """An event that Ctrl-C sets; the second one is as usual."""
    stop = threading.Event()

    def interrupted(_number: int, _frame: object) -> None:
        stop.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    signal.signal(signal.SIGINT, interrupted)
    signal.signal(signal.SIGTERM, interrupted)
    return stop


def _watch(
    stage: Stage, scene: Scene, console: Console, stop: threading.Event
) -> tuple[list[TouchStatus], dict[str, set[str]]]:
    """Show the users until the end; returns their last statuses, and what switched forces off."""
    clock = SystemClock()
    opened = clock.now()
    begun: float | None = None
    faults: dict[str, set[str]] = {}
    traces: dict[str, deque[float]] = {name: deque(maxlen=_TRACE) for name in scene.names}
    statuses = stage.statuses()
    with Live(console=console, refresh_per_second=10, transient=True) as live:
        while not stop.wait(_REFRESH):
            now = clock.now()
            statuses = stage.statuses()
            for status in statuses:
                traces[status.name].append(status.force)
                if status.fault and begun is not None:
                    faults.setdefault(status.name, set()).add(status.fault)
                if status.state.startswith("gone"):
                    raise DemoFailed(f"{status.name} is {status.state}")
            if begun is None and all(s.state in ("touching", "free") for s in statuses):
                begun = now
            if begun is None and now - opened > _GATHER:
                states = ", ".join(f"{s.name} is {s.state}" for s in statuses)
                raise DemoFailed(f"not everybody came within {_GATHER:g} s: {states}")
            since = None if begun is None else now - begun
            live.update(_picture(scene, statuses, traces, since, console.width))
            if begun is not None and scene.duration is not None and now - begun >= scene.duration:
                break
    return statuses, faults


def _picture(
    scene: Scene,
    statuses: list[TouchStatus],
    traces: dict[str, deque[float]],
    since: float | None,
    width: int,
) -> Group:
    """The live view."""
    if since is None:
        progress = "everybody comes ..."
    elif scene.duration is None:
        progress = f"{since:.0f} s; Ctrl-C for the result"
    else:
        progress = f"{since:.0f} of {scene.duration:g} s"
    head = Text.assemble(
        ("left", "bold"),
        f" presses and lets go every {scene.rhythm.period:.1f} s, the others rest. ",
        (f"{scene.law.value} law, {1e3 * scene.delay:g} ms each way", "bold"),
        f", {scene.simulation_hz:g} Hz. {progress}",
    )
    lines = Table(box=None, pad_edge=False, show_header=False)
    for name, forces in traces.items():
        lines.add_row(name, Text(sparkline(forces), style="cyan"))
    what = Text(f"force over the last {_TRACE * _REFRESH:.0f} s, up to {_TOP:g} N", style="dim")
    return Group(head, "", status_table(statuses, width=width), what, lines)


def sparkline(values: deque[float]) -> str:
    """Forces as blocks of growing height."""
    top = len(_BLOCKS) - 1
    return "".join(_BLOCKS[min(top, max(0, round(top * v / _TOP)))] for v in values)
