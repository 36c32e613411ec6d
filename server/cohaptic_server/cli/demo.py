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
from rich.console import Console
from rich.live import Live

from cohaptic.clock import SystemClock
from cohaptic.control.law import Law
from cohaptic.status.report import TouchStatus
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.cli.object_options import (
    SOLID,
    ContactRadius,
    Edge,
    Fix,
    FixMesh,
    Order,
    Poisson,
    Repair,
    Scale,
    Simplify,
    Young,
)
from cohaptic_server.cli.progress_bar import progress_bar
from cohaptic_server.demo.browser import open_page
from cohaptic_server.demo.live_view import TRACE, picture, traced
from cohaptic_server.demo.processes import DemoFailed, Stage
from cohaptic_server.demo.result import evaluate
from cohaptic_server.demo.scene import Scene
from cohaptic_server.demo.set_up import BALLOON, FIX, serve_options, set_up
from cohaptic_server.demo.summary import show
from cohaptic_server.objects.catalogue import BODIES
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.shell.listener import page_address

_REFRESH = 0.1  # s
_GATHER = 45.0  # s for every client to be there and engaged
_WITHOUT_TERMINAL = 15.0  # s


def demo(
    duration: Annotated[
        float | None,
        typer.Option(help="Seconds.", show_default="until Ctrl-C; 15 without a terminal"),
    ] = None,
    users: Annotated[int, typer.Option(help="Hands round the balloon, 2 to 16.")] = 2,
    delay_ms: Annotated[float, typer.Option(help="Injected delay, one way, both ways.")] = 80.0,
    jitter_ms: Annotated[float, typer.Option(help="Largest extra delay, one way.")] = 0.0,
    law: Annotated[Law, typer.Option(help="Local model.")] = Law.PREDICTIVE,
    friction: Annotated[
        float,
        typer.Option(
            help="Coefficient mu of two fingers that stick: one drags the other. 0: none."
        ),
    ] = 0.0,
    simulation_hz: Annotated[float, typer.Option(help="Ticks per second, 10 to 200.")] = 60.0,
    seed: Annotated[int, typer.Option(help="Of the jitter.")] = 0,
    body: Annotated[str, typer.Option(help="What is touched: balloon, or a mesh file.")] = BALLOON,
    nonlinear: Annotated[bool, typer.Option("--nonlinear", help="Finite deformation.")] = False,
    young: Young = SOLID.young,
    poisson: Poisson = SOLID.nu,
    fix: Fix = "",
    fix_mesh: FixMesh = None,
    scale: Scale = 1.0,
    edge: Edge = 0.05,
    order: Order = SOLID.order,
    contact_radius: ContactRadius = 0.0,
    repair: Repair = False,
    simplify: Simplify = 0,
    json: Annotated[Path | None, typer.Option(help="Write the result to this file.")] = None,
    keep: Annotated[
        Path | None, typer.Option(help="Keep recordings and logs in this folder.")
    ] = None,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Do not open the page, only say where it is.")
    ] = False,
) -> None:
    """Watch users feel each other on a balloon or an object of yours, over a network with delay.

    A server and simulated users run as separate processes on this machine. The first user presses
    and releases; the others rest on the body and feel it. At the end the forces are compared
    with the truth: body and hands in equilibrium, without any network.

    With --friction, 0.8 for a dry fingertip, two stand side by side and stick: the first drags the
    skin of the balloon along and back, and the second feels the force along the surface.

    On an object from a file (--body; held by --fix, "z < 15%" if not given) hands stand where they
    feel each other.
    """
    console = Console()
    if duration is None and not console.is_terminal:
        duration = _WITHOUT_TERMINAL
    scene = Scene(
        users,
        1e-3 * delay_ms,
        1e-3 * jitter_ms,
        law,
        simulation_hz,
        seed,
        duration,
        friction=friction,
    )
    if json is not None and not json.resolve().parent.is_dir():
        raise DemoFailed(f"--json {json}: there is no folder {json.resolve().parent}")
    material = SolidSettings(young, poisson, contact_radius, order)
    rule = fix or (FIX if fix_mesh is None and body not in BODIES else "")
    solid = ObjectFile(Path(body), rule, scale, edge, repair, material, fix_mesh, simplify)
    with progress_bar(f"preparing {body}") as progress:
        touched, scene, words = set_up(scene, body, solid, nonlinear=nonlinear, progress=progress)
    if words:
        console.print(words, highlight=False)
    with _folder(keep) as folder:
        stage = Stage(scene, folder, serve_options(body, solid, nonlinear=nonlinear))
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
            result = evaluate(scene, touched, recordings, statuses, faults)
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
    traces: dict[str, deque[float]] = {name: deque(maxlen=TRACE) for name in scene.names}
    statuses = stage.statuses()
    with Live(console=console, refresh_per_second=10, transient=True) as live:
        while not stop.wait(_REFRESH):
            now = clock.now()
            statuses = stage.statuses()
            for status in statuses:
                traces[status.name].append(traced(scene, status))
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
            live.update(picture(scene, statuses, traces, since, console.width, every=_REFRESH))
            if begun is not None and scene.duration is not None and now - begun >= scene.duration:
                break
    return statuses, faults
