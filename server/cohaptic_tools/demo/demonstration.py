"""Performs a demonstration: runs its processes, shows them live, and compares the forces."""

from __future__ import annotations

import contextlib
import signal
import tempfile
import threading
from collections.abc import Generator
from dataclasses import replace
from pathlib import Path

import typer
from rich.console import Console

from cohaptic.cli.output import new_output
from cohaptic.errors import SettingError
from cohaptic.recording.part import Part
from cohaptic_server.bodies.body import Body
from cohaptic_server.cli.object_options import ObjectOptions
from cohaptic_server.cli.progress_bar import progress_bar
from cohaptic_server.cli.resolved_object import resolved
from cohaptic_server.objects.cost import Demand
from cohaptic_server.settings import ServerSettings
from cohaptic_server.shell.listener import page_address
from cohaptic_server.touchable import is_file
from cohaptic_tools.browser import open_page
from cohaptic_tools.demo.capacity import measure, rate_for
from cohaptic_tools.demo.live_view import watch
from cohaptic_tools.demo.processes import DemoFailed, Stage
from cohaptic_tools.demo.result import DemoResult, evaluate
from cohaptic_tools.demo.scene import Scene
from cohaptic_tools.demo.set_up import FIX, check_body, serve_options, set_up
from cohaptic_tools.demo.summary import show

_WITHOUT_TERMINAL = 15.0  # s; default duration without a terminal, on which Ctrl-C could end it


def demonstrate(
    scene: Scene,
    hz: float | None,
    body: str,
    options: ObjectOptions,
    json: Path | None,
    keep: Path | None,
    *,
    overwrite: bool,
    nonlinear: bool,
    browser: bool,
) -> DemoResult:
    """Perform a scene on a body, and print and return the result.

    Args:
        scene: Scene in which rate and places of the hands are not chosen yet.
        hz: Ticks per second; None for a rate that this machine keeps up with.
        body: Name of the body, or path of a file.
        options: Options of an object from a file.
        json: Path of the file for the result; None writes no file.
        keep: Folder in which recordings and logs stay; None deletes them at the end.
        overwrite: Whether the result and the recordings may replace files.
        nonlinear: Whether the body is nonlinear (finite deformation).
        browser: Whether to open the web page of the server.

    Raises:
        CohapticError: The scene cannot be shown on the body, or a process has failed.
    """
    console = Console()
    if scene.duration is None and not console.is_terminal:
        scene = replace(scene, duration=_WITHOUT_TERMINAL)
    output = new_output("--json", json, overwrite=overwrite)
    check_body(scene, body)
    if keep is not None:
        _check_kept(keep, scene, overwrite=overwrite)
    touched, scene, serve_arguments = _prepared(
        scene, hz, body, options, console, nonlinear=nonlinear
    )
    result = _perform(
        scene, touched, serve_arguments, console, keep, overwrite=overwrite, browser=browser
    )
    console.print(show(result))
    if output is not None:
        output.write(result.model_dump_json(indent=2) + "\n")
        console.print(f"written to {json}", highlight=False)
    if keep is not None:
        console.print(f"recordings and logs are in {keep}", highlight=False)
    return result


def _prepared(
    scene: Scene,
    hz: float | None,
    body: str,
    options: ObjectOptions,
    console: Console,
    *,
    nonlinear: bool,
) -> tuple[Body, Scene, list[str]]:
    """Return the body, the scene with its rate and places, and the options of the server."""
    if not (options.auto or options.given.keys() & {"fix", "fix_mesh"}) and is_file(body):
        options = replace(options, given={**options.given, "fix": FIX})
    if hz is not None:
        ServerSettings(simulation_hz=hz)  # which checks it
    rate, words = rate_for(measure(), scene.users, hz)
    scene = replace(scene, simulation_hz=rate)
    reported = [words]
    with progress_bar(f"preparing {body}") as progress:
        source = options.of(Path(body))
        if is_file(body):
            demand = Demand(scene.users, scene.simulation_hz, nonlinear)
            source = resolved(source.path, options, progress, reported.append, demand)
        touched, scene, words = set_up(scene, body, source, nonlinear=nonlinear, progress=progress)
    for sentence in (*reported, words):
        if sentence:
            console.print(sentence, highlight=False)
    serve_arguments = serve_options(body, source, nonlinear=nonlinear, users=scene.users)
    return touched, scene, serve_arguments


def _perform(
    scene: Scene,
    body: Body,
    serve_arguments: list[str],
    console: Console,
    keep: Path | None,
    *,
    overwrite: bool,
    browser: bool,
) -> DemoResult:
    """Run the processes of a scene until its end, and return the evaluated recordings."""
    with _recordings_folder(keep) as folder:
        typer.echo("starting the server ...", err=True)

        def tell(words: str) -> None:
            console.print(words, highlight=False)

        with Stage(scene, folder, serve_arguments, tell, overwrite=overwrite) as stage:
            stop = _stop_on_interrupt()
            address = page_address(stage.url)
            tell(f"page {address}")
            if console.is_terminal and browser:
                open_page(address)
            statuses, faults = watch(stage, scene, console, stop)
        with console.status("comparing with the truth"):
            recordings = [stage.recording(name) for name in scene.names]
            missing = [name for name in scene.names if not stage.recorded(name)]
            if missing:
                words = "; ".join(f"{name}: {stage.users[name].words()}" for name in missing)
                raise DemoFailed(f"no recording of {', '.join(missing)} ({words})")
            return evaluate(scene, body, recordings, statuses, faults)


def _check_kept(keep: Path, scene: Scene, *, overwrite: bool) -> None:
    """Refuse a folder that cannot be made, or has recordings or logs of an earlier demonstration.

    Raises:
        SettingError: It cannot be used, and the error says why.
    """
    try:
        keep.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = f"{keep} ({error.strerror or error})"
        raise SettingError("--keep", problem, "a folder that can be written") from error
    recordings = [keep / f"{name}.npz" for name in scene.names]
    logs = [keep / f"{name}.log" for name in ("server", *scene.names)]
    for path in (*recordings, *logs):
        new_output("--keep", path, overwrite=overwrite)
    for path in recordings:
        Part.claim("--keep", path).remove()


@contextlib.contextmanager
def _recordings_folder(keep: Path | None) -> Generator[Path, None, None]:
    """Yield the folder for recordings and logs: `keep`, or a temporary folder if it is None."""
    if keep is not None:
        yield keep
        return
    with tempfile.TemporaryDirectory(prefix="cohaptic-demo-") as folder:
        yield Path(folder)


def _stop_on_interrupt() -> threading.Event:
    """Return an event that the first Ctrl-C sets; a second Ctrl-C raises KeyboardInterrupt."""
    stop = threading.Event()

    def interrupted(_number: int, _frame: object) -> None:
        stop.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    signal.signal(signal.SIGINT, interrupted)
    signal.signal(signal.SIGTERM, interrupted)
    return stop
