"""The real thing: server and clients as processes on loopback. Real time, so few and short."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cohaptic.clock import SystemClock
from cohaptic.recording.part import part_of
from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.hand import Hand
from cohaptic.status.report import TouchStatus
from cohaptic_client.loop.arrival import LONGEST_PATIENCE
from cohaptic_client.loop.arrival import PATIENCE as PATIENCE_OF_LOOP
from cohaptic_client.loop.passivity import MAX_DAMPING
from cohaptic_client.loop.safety import EXTERNAL_RATE, SAFETY_FADE_RATE, SafetyLimits
from cohaptic_server.numeric import Floats
from cohaptic_tools.demo.analysis import STEP, Recording
from cohaptic_tools.demo.processes import Stage
from cohaptic_tools.demo.scene import PRESS_DEPTH, Scene
from tests.patience import PATIENCE

pytestmark = [
    pytest.mark.alone,
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]

CLOCK = SystemClock()
BALLOON_K_O = 250.0  # N/m, on the equator
STEP_TIME = 0.02  # s over which a jump is measured: more than a scheduler's hiccup


def wall() -> float:
    return CLOCK.now() + CLOCK.to_wall()


def wait_until(stage: Stage, condition: Callable[[dict[str, TouchStatus]], bool]) -> None:
    deadline = CLOCK.now() + PATIENCE
    while not condition({s.name: s for s in stage.statuses()}):
        assert CLOCK.now() < deadline, [s.model_dump() for s in stage.statuses()]
        threading.Event().wait(0.02)


def given(path: Path) -> tuple[Floats, Floats]:
    """Time (Unix) and force of every period of a recording, shapes (n,)."""
    c = Recording.load(path).columns
    return c["t"], np.sqrt(c["fx"] ** 2 + c["fy"] ** 2 + c["fz"] ** 2)


def force_of(path: Path) -> tuple[Floats, Floats]:
    """The same on a grid."""
    at, force = given(path)
    t = np.arange(at[0], at[-1], STEP)
    return t, np.interp(t, at, force)


def largest_change(t: Floats, force: Floats, start: float, end: float) -> float:
    """Largest change of force within `STEP_TIME` between two times [N]."""
    part = force[(t >= start) & (t <= end)]
    n = round(STEP_TIME / STEP)
    return float(np.abs(part[n:] - part[:-n]).max())


@pytest.mark.smoke
def test_the_demo_shows_two_users_who_feel_each_other(tmp_path: Path) -> None:
    result = tmp_path / "out.json"
    output = ["--json", str(result)]
    # Time for two presses: one in which a server stood still does not count.
    done = subprocess.run(
        [sys.executable, "-m", "cohaptic", "demo", "--duration", "12", "--delay-ms", "30", *output],
        capture_output=True,
        text=True,
        timeout=3 * PATIENCE,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "right felt left press" in done.stdout
    demo = json.loads(result.read_text())
    assert (demo["law"], demo["simulation_hz"], demo["delay_ms"]) == ("predictive", 60.0, 30.0)
    assert [user["name"] for user in demo["users"]] == ["left", "right"]
    for user in demo["users"]:
        assert user["stable"] is True
        assert user["force_error"] <= 0.05
        assert user["truth_from_others_n"] > 1.0
        assert user["rest"] == "rests"
        assert user["loop_hz"] > 0.0
        assert user["loop_late_p99_us"] > 0.0
    left, right = demo["users"]
    # Who presses has nothing to wait for, and nothing is felt before it can have arrived.
    assert left["felt_delay_ms"] is None
    assert right["felt_delay_ms"] >= 60.0


def test_a_killed_client_jolts_nobody_and_can_be_replaced(tmp_path: Path) -> None:
    scene = Scene(link=LinkSettings(0.02))
    with Stage(scene, tmp_path) as stage:
        wait_until(stage, lambda s: s["left"].level == 1.0 and s["right"].felt_from_others > 1.5)
        wait_until(stage, lambda s: s["left"].level < 1.0)
        let_go = wall()
        wait_until(stage, lambda s: s["left"].level == 1.0 and s["right"].felt_from_others > 1.5)
        threading.Event().wait(0.5)
        os.kill(stage.users["left"].pid, signal.SIGKILL)
        killed = wall()
        wait_until(stage, lambda s: s["right"].felt_from_others < 0.1)
        threading.Event().wait(0.5)
        stage.users["left"].wait()
        part = part_of(stage.recording("left"))  # no recording takes the name of what is left
        part.rename(part.with_name("killed.npz.part"))

        stage.add_user(0)
        wait_until(stage, lambda s: s["left"].level == 1.0 and s["right"].felt_from_others > 1.5)
    t, force = force_of(stage.recording("right"))
    # It may be seen late that left lets go; before that it has rested for two seconds.
    letting_go = largest_change(t, force, let_go - 1.0, let_go + 0.8)
    losing = largest_change(t, force, killed - 0.1, killed + 1.0)
    assert losing <= letting_go
    assert "left left: " in (tmp_path / "right.log").read_text()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_server_that_dies_or_hangs_leaves_hands_with_a_smooth_zero(
    tmp_path: Path, how: signal.Signals
) -> None:
    limits = SafetyLimits()
    # Law force of a hand that has gone on to where it wants to be, at the worst.
    hardest = BALLOON_K_O * PRESS_DEPTH
    longest = LONGEST_PATIENCE + hardest / SAFETY_FADE_RATE
    with Stage(Scene(link=LinkSettings(0.02)), tmp_path) as stage:
        wait_until(stage, lambda s: s["left"].level == 1.0 and s["right"].felt_from_others > 1.5)
        threading.Event().wait(0.5)
        os.kill(stage.server.pid, how)
        lost = wall()
        threading.Event().wait(longest + 0.3)
        if how is signal.SIGSTOP:
            os.kill(stage.server.pid, signal.SIGCONT)
            wait_until(stage, lambda s: all(u.state == "touching" for u in s.values()))
            threading.Event().wait(1.2)
    for name in ("left", "right"):
        t, force = given(stage.recording(name))
        # At least the last one, also of a loop that stood still for longer just then.
        pressed = float(force[(t >= min(lost - 0.1, float(t[t < lost][-1]))) & (t < lost)].max())
        assert pressed > 1.5
        # Twice as long a silence as this link has had is none; then a fade, of a force that the law
        # asks more for meanwhile: the hand, held no longer, goes on to where it wants to be.
        heard = max(lost, last_patch(stage, name, lost + longest))
        silent = max(limits.silent_after, PATIENCE_OF_LOOP * longest_gap(stage, name, heard))
        grows = 1.0 + BALLOON_K_O / Hand().stiffness
        gone = silent + max(limits.fade_time, grows * pressed / SAFETY_FADE_RATE)
        zero = t[(t > lost) & (force == 0.0)]
        # Injected delay, and a scheduler's leave on a busy machine.
        assert zero.size
        late = stood_still(t, heard, float(zero[0]), limits.period)
        assert zero[0] < heard + gone + late + scene_delay() + 0.1
        # Nothing but the hand itself moves its force faster, while it goes and when it comes back.
        assert largest_unexplained(stage, name, lost - 0.1) <= EXTERNAL_RATE * STEP_TIME
        if how is signal.SIGSTOP:
            # Left may be on its way out by then, right never is.
            assert name == "left" or force[-400] > 1.0
        assert force[-1] == 0.0


def largest_unexplained(stage: Stage, name: str, since: float) -> float:
    """Largest change of a force within `STEP_TIME` that the hand's own way does not cause [N]."""
    c = Recording.load(stage.recording(name)).columns
    t = np.arange(since, c["t"][-1], STEP)
    force, tip = (
        np.stack([np.interp(t, c["t"], c[key]) for key in keys], axis=1)
        for keys in (("fx", "fy", "fz"), ("x", "y", "z"))
    )
    n = round(STEP_TIME / STEP)
    change, way = (np.linalg.norm(a[n:] - a[:-n], axis=1) for a in (force, tip))
    # On the law's spring, and against the passivity layer's damping.
    stiffness = float(c["k_h"].max()) + MAX_DAMPING / STEP_TIME
    return float((change - stiffness * way).max())


def longest_gap(stage: Stage, name: str, before: float) -> float:
    """Longest time between two patches that came to a client until then [s]."""
    c = Recording.load(stage.recording(name)).columns
    return float(c["patch_age"][c["t"] < before].max())


def last_patch(stage: Stage, name: str, before: float) -> float:
    """When the last one came to a loop until then; what was on its way may come late."""
    c = Recording.load(stage.recording(name)).columns
    return float((c["t"] - c["patch_age"])[c["t"] < before].max())


def stood_still(t: Floats, start: float, end: float, period: float) -> float:
    """By how much periods were longer than the two of which a fade counts no more [s]."""
    first, last = max(0, int(np.searchsorted(t, start)) - 1), int(np.searchsorted(t, end))
    return float(np.maximum(np.diff(t[first : last + 1]) - 2.0 * period, 0.0).sum())


def scene_delay() -> float:
    return Scene(link=LinkSettings(0.02)).link.delay
