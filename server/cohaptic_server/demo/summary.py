"""The result of a demonstration, for programs (JSON) and for people (one glance)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from rich.console import Group
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from cohaptic.report import TouchStatus
from cohaptic_server.bodies.body import Body
from cohaptic_server.bodies.mesh import Floats
from cohaptic_server.demo.analysis import (
    Recording,
    Timeline,
    felt_delay,
    is_still,
    mean_over,
    patch_rate,
    plateaus,
    press_windows,
)
from cohaptic_server.demo.replay import felt_at_once
from cohaptic_server.demo.scene import Scene, truth

MAX_FORCE = 10.0  # N; what a simulated device gives
GOOD_ERROR = 0.05  # of a force, that nobody feels: half of the least difference a hand can tell
_FELT = 0.05  # N; less is not felt, and a share of it says nothing
_PUNCTUAL = 0.8  # of the patches must come for a result to say something about the method
_REPLAYED = 4  # presses and releases from which delays are found; each is seconds of ticks
_LONGEST = 0.25  # s on top of the injected delay, up to which a felt delay is looked for


class UserResult(BaseModel):
    """One user; None where the demonstration was too short to tell.

    Fields:
        felt_from_others_n: Force that is there because others touch, pressed, mean [N].
        truth_from_others_n: The same in the equilibrium of body and hands, without a network [N].
        force_error: Their difference over the truth, or over 0.05 N where that is more.
        force_n, truth_force_n: The whole force on the hand, and its truth [N].
        k_o: Stiffness of the body at the contact [N/m].
        k_h: Gain at the end [N/m].
        loop_hz: Periods of the haptic loop per second.
        loop_late_p99_us: Lateness of a period, 99th percentile [us].
        loop_missed: Periods left out.
        round_trip_ms: Measured between client and server [ms].
        felt_delay_ms: From one hand's press to this hand's force [ms].
        patch_hz: Patches that came per second.
        stable: Whether the force comes to rest and stays within the device's limit.
        faults: What switched the force off on the way.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    felt_from_others_n: float | None
    truth_from_others_n: float
    force_error: float | None
    force_n: float | None
    truth_force_n: float
    k_o: float
    k_h: float
    loop_hz: float
    loop_late_p99_us: float
    loop_missed: int
    round_trip_ms: float
    felt_delay_ms: float | None
    patch_hz: float | None
    stable: bool | None
    faults: tuple[str, ...]


class DemoResult(BaseModel):
    """A whole demonstration."""

    model_config = ConfigDict(frozen=True)

    law: str
    simulation_hz: float
    delay_ms: float = Field(description="Injected, one way.")
    jitter_ms: float
    seed: int
    presses: int = Field(description="Measured presses of the first user.")
    users: tuple[UserResult, ...]


def evaluate(
    scene: Scene,
    body: Body,
    recordings: Sequence[Path],
    statuses: Sequence[TouchStatus],
    faults: dict[str, set[str]],
) -> DemoResult:
    """Compare what was recorded with what should have been felt."""
    timeline = Timeline.of([Recording.load(path) for path in recordings])
    pressed_truth = truth(scene, body, pressed=True)
    stretch = 0.5 * scene.rhythm.period - scene.rhythm.ramp
    pressed = plateaus(timeline, pressed=True, expected=stretch)
    released = plateaus(timeline, pressed=False, expected=stretch)
    injected = 2.0 * (scene.delay + scene.jitter)
    felt = mean_over(timeline.columns["felt_from_others"], pressed)
    force = mean_over(timeline.force, pressed)
    still = is_still(timeline.force, [*pressed, *released] if pressed else [], MAX_FORCE)
    delays = _delays(timeline, body, injected)
    k_h = timeline.columns["k_h"][:, -1] if timeline.t.size else np.zeros(scene.users)
    users: list[UserResult] = []
    for i, name in enumerate(scene.names):
        true = float(pressed_truth.felt_from_others[i])
        status = statuses[i]
        tripped = tuple(sorted(faults.get(name, ())))
        thrown = any("the hand moved" in fault for fault in tripped)
        users.append(
            UserResult(
                name=name,
                felt_from_others_n=_known(felt[i]),
                truth_from_others_n=true,
                force_error=_known(abs(felt[i] - true) / max(abs(true), _FELT)),
                force_n=_known(force[i]),
                truth_force_n=float(pressed_truth.force[i]),
                k_o=status.k_o,
                k_h=float(k_h[i]),
                loop_hz=status.loop_hz,
                loop_late_p99_us=1e6 * status.loop_late_p99,
                loop_missed=status.loop_missed,
                round_trip_ms=1e3 * status.round_trip,
                felt_delay_ms=_known(1e3 * delays[i]),
                patch_hz=_known(patch_rate(timeline, i)),
                stable=False if thrown else still[i],
                faults=tripped,
            )
        )
    return DemoResult(
        law=scene.law.value,
        simulation_hz=scene.simulation_hz,
        delay_ms=1e3 * scene.delay,
        jitter_ms=1e3 * scene.jitter,
        seed=scene.seed,
        presses=len(pressed),
        users=tuple(users),
    )


def _delays(timeline: Timeline, body: Body, injected: float) -> Floats:
    """Median over the last presses of how late each user felt the others [s], shape (users,)."""
    felt = timeline.columns["u_others"]
    found: list[list[float]] = []
    for window in press_windows(timeline, injected=injected)[-_REPLAYED:]:
        at_once = felt_at_once(timeline, body, window)
        found.append(
            [
                felt_delay(felt[i, window], at_once[i], longest=injected + _LONGEST)
                for i in range(len(felt))
            ]
        )
    return np.median(np.array(found), axis=0) if found else np.full(len(felt), np.nan)


def show(result: DemoResult) -> Panel:
    """The result in one glance."""
    table = Table(box=None, pad_edge=False)
    for name in ("user", "felt of the others", "truth", "off by", "felt after", "stable", "loop"):
        table.add_column(name, justify="left" if name == "user" else "right")
    for user in result.users:
        error = user.force_error
        good = error is not None and error <= GOOD_ERROR
        table.add_row(
            user.name,
            _number(user.felt_from_others_n, "+.2f", " N"),
            f"{user.truth_from_others_n:+.2f} N",
            Text(_number(error, ".1%"), style="green" if good else "yellow"),
            _number(user.felt_delay_ms, ".0f", " ms"),
            {True: Text("yes", "green"), False: Text("NO", "bold red"), None: Text("?")}[
                user.stable
            ],
            f"{user.loop_hz:.0f} Hz",
        )
    faults = [f"{user.name}: {fault}" for user in result.users for fault in user.faults]
    notes = [Text(f"force was off for a while: {fault}", style="yellow") for fault in faults]
    return Panel(
        Group(Text(verdict(result), style="bold"), "", table, *notes),
        title="what they felt of each other",
        title_align="left",
        expand=False,
    )


def verdict(result: DemoResult) -> str:
    """One sentence on the whole demonstration."""
    how = f"{result.law} law, {result.delay_ms:g} ms each way, {result.simulation_hz:g} Hz"
    if any(user.stable is False for user in result.users):
        names = ", ".join(user.name for user in result.users if user.stable is False)
        return f"Unstable: the force of {names} did not come to rest ({how})."
    rates = [user.patch_hz for user in result.users if user.patch_hz is not None]
    rate = min(rates, default=result.simulation_hz)
    if rate < _PUNCTUAL * result.simulation_hz:
        return (
            f"This machine cannot keep up with {len(result.users)} users: patches came at"
            f" {rate:.0f} of {result.simulation_hz:g} Hz.\nTake fewer users or a lower"
            f" --simulation-hz ({how})."
        )
    if result.presses == 0:
        return f"Too short to tell: no whole press was seen ({how}). Let it run for longer."
    worst = max(user.force_error or 0.0 for user in result.users)
    right = result.users[1]
    felt = _number(right.felt_from_others_n, ".2f", " N")
    after = _number(right.felt_delay_ms, ".0f", " ms")
    return (
        f"{right.name} felt {result.users[0].name} press with {felt}, {after} later.\n"
        f"Every force came to rest, at most {worst:.1%} from the truth ({how})."
    )


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "?" if value is None else f"{value:{form}}{unit}"
