"""`cohaptic demo`."""

from __future__ import annotations

import contextlib
import signal
import sys
import tempfile
import threading
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cohaptic.control.law import Law
from cohaptic_server.bodies.body import Body
from cohaptic_server.cli.compiling_beside import compiling_beside
from cohaptic_server.cli.object_options import ObjectOptions, takes_object
from cohaptic_server.cli.progress_bar import progress_bar
from cohaptic_server.cli.resolved_object import SimulationHz, resolved
from cohaptic_server.demo.browser import open_page
from cohaptic_server.demo.live_view import watch
from cohaptic_server.demo.processes import DemoFailed, Stage
from cohaptic_server.demo.result import DemoResult, evaluate
from cohaptic_server.demo.scene import Scene
from cohaptic_server.demo.set_up import BALLOON, FIX, check_body, serve_options, set_up
from cohaptic_server.demo.summary import show
from cohaptic_server.objects.catalogue import BODIES, is_file
from cohaptic_server.objects.demand import Demand
from cohaptic_server.shell.listener import page_address

_WITHOUT_TERMINAL = 15.0  # s; the default duration where nobody can press Ctrl-C

Duration = Annotated[
    float | None,
    typer.Option(help="Seconds.", show_default="until Ctrl-C; 15 without a terminal"),
]
Friction = Annotated[
    float,
    typer.Option(help="Coefficient mu of two fingers that stick: one drags the other. 0: none."),
]
Keep = Annotated[Path | None, typer.Option(help="Keep recordings and logs in this folder.")]
NoBrowser = Annotated[
    bool, typer.Option("--no-browser", help="Do not open the page, only say where it is.")
]


@takes_object
def demo(
    duration: Duration = None,
    users: Annotated[int, typer.Option(help="Hands round the balloon, 2 to 16.")] = 2,
    delay_ms: Annotated[float, typer.Option(help="Injected delay, one way, both ways.")] = 80.0,
    jitter_ms: Annotated[float, typer.Option(help="Largest extra delay, one way.")] = 0.0,
    law: Annotated[Law, typer.Option(help="Local model.")] = Law.PREDICTIVE,
    friction: Friction = 0.0,
    simulation_hz: SimulationHz = 60.0,
    seed: Annotated[int, typer.Option(help="Of the jitter.")] = 0,
    body: Annotated[str, typer.Option(help="What is touched: balloon, or a mesh file.")] = BALLOON,
    nonlinear: Annotated[bool, typer.Option("--nonlinear", help="Finite deformation.")] = False,
    *,
    options: ObjectOptions,
    json: Annotated[Path | None, typer.Option(help="Write the result to this file.")] = None,
    keep: Keep = None,
    no_browser: NoBrowser = False,
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
        users, 1e-3 * delay_ms, 1e-3 * jitter_ms, law, simulation_hz, seed, duration,
        friction=friction,
    )  # fmt: skip
    if json is not None and not json.resolve().parent.is_dir():
        raise DemoFailed(f"--json {json}: there is no folder {json.resolve().parent}")
    check_body(scene, body)
    if not (options.auto or options.fix or options.fix_mesh) and body not in BODIES:
        options = replace(options, fix=FIX)
    told: list[str] = []
    with progress_bar(f"preparing {body}") as progress:
        source = options.of(Path(body))
        if is_file(body):
            demand = Demand(users, simulation_hz, nonlinear)
            source = resolved(source.path, options, progress, told.append, demand)
        touched, scene, words = set_up(scene, body, source, nonlinear=nonlinear, progress=progress)
    for sentence in told:
        console.print(sentence, highlight=False)
    if words:
        console.print(words, highlight=False)
    serve_arguments = serve_options(body, source, nonlinear=nonlinear, users=users)
    result = _perform(scene, touched, serve_arguments, console, keep, browser=not no_browser)
    console.print(show(result))
    if json is not None:
        json.write_text(result.model_dump_json(indent=2) + "\n")
        console.print(f"written to {json}", highlight=False)
    if any(user.stable is False for user in result.users):
        sys.exit(1)


def _perform(
    scene: Scene,
    body: Body,
    serve_arguments: list[str],
    console: Console,
    keep: Path | None,
    *,
    browser: bool,
) -> DemoResult:
    """Run the processes of a scene until its end, and compare their recordings."""
    with _recordings_folder(keep) as folder:
        typer.echo("starting the server ...", err=True)

        def tell(words: str) -> None:
            console.print(words, highlight=False)

        with Stage(scene, folder, serve_arguments, tell) as stage:
            stop = _stop_on_interrupt()
            address = page_address(stage.url)
            tell(f"page {address}")
            if console.is_terminal and browser:
                open_page(address)
            with compiling_beside(tell, folder / "compiling.log"):
                statuses, faults = watch(stage, scene, console, stop)
        with console.status("comparing with the truth"):
            recordings = [stage.recording(name) for name in scene.names]
            missing = [path.stem for path in recordings if not path.exists()]
            if missing:
                words = "; ".join(f"{name}: {stage.users[name].words()}" for name in missing)
                raise DemoFailed(f"no recording of {', '.join(missing)} ({words})")
            return evaluate(scene, body, recordings, statuses, faults)


@contextlib.contextmanager
def _recordings_folder(keep: Path | None) -> Generator[Path, None, None]:
    """The folder of recordings and logs: the one to keep, or a temporary one."""
    if keep is not None:
        keep.mkdir(parents=True, exist_ok=True)
        yield keep
        return
    with tempfile.TemporaryDirectory(prefix="cohaptic-demo-") as folder:
        yield Path(folder)


def _stop_on_interrupt() -> threading.Event:
    """An event that the first Ctrl-C sets; a second one raises KeyboardInterrupt as usual."""
    stop = threading.Event()

    def interrupted(_number: int, _frame: object) -> None:
        stop.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    signal.signal(signal.SIGINT, interrupted)
    signal.signal(signal.SIGTERM, interrupted)
    return stop
