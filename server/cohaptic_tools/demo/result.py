"""Evaluates the recordings of a demonstration; the result is a value that is written as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from cohaptic.simulated.networks import words_for
from cohaptic.status.report import TouchStatus
from cohaptic_server.bodies.body import Body
from cohaptic_tools.demo.analysis import (
    Recording,
    Timeline,
    measured,
    patch_rate,
    press_windows,
    stretches,
)
from cohaptic_tools.demo.comparison import Compared, compare
from cohaptic_tools.demo.lateness import LEAST
from cohaptic_tools.demo.punctuality import (
    Blame,
    Lateness,
    in_stretches,
    lateness,
    limit,
    part_on_time,
)
from cohaptic_tools.demo.rest import Rest, judge, reaches_limit, worst
from cohaptic_tools.demo.scene import Scene

MAX_FORCE = 10.0  # N; largest force of a simulated device
GOOD_ERROR = 0.05  # relative error; half of the just noticeable difference of forces


class UserResult(BaseModel):
    """Result of one user; a field is None if the demonstration was too short to measure it.

    Fields:
        name: Name of the user.
        felt_from_others_n: Mean force that the other users cause while the first presses; in a
            scene with friction the change of the tangential force by the drag [N].
        truth_from_others_n: The same force in the equilibrium of body and hands, without a network
            [N]; None if a finger slips, since there is no such equilibrium then.
        force_error: Difference of these two forces divided by the second, or by 0.05 N if that is
            larger.
        force_n, truth_force_n: Force on the hand, measured and in equilibrium [N].
        k_o: Stiffness of the body at the contact [N/m].
        k_h: Gain of the user's haptic loop at the end [N/m].
        max_stiffness: Largest stiffness that the device renders [N/m].
        soft: Whether the device is softer than the body at the contact.
        friction_needed: Coefficient of friction below which the finger slips; None in a scene
            without friction.
        loop_hz: Periods of the haptic loop per second.
        loop_late_p99_us: Lateness of a period, 99th percentile [us].
        loop_missed: Number of periods of the haptic loop that were omitted.
        round_trip_ms: Measured round trip between client and server [ms].
        felt_onset_ms, felt_delay_ms, felt_most_ms: Largest delay of any level up to a tenth, half
            and nine tenths of the change of force, relative to the same hands simulated without a
            network; in a scene with friction relative to the recorded force of the first hand [ms].
            None for the first hand, which causes the change, and if the force does not change.
        patch_hz: Received patches per second.
        patch_late_ms: Time by which a patch came later than usual while hands held still, at most
            [ms].
        loop_stall_ms: Time between two periods of the haptic loop then, at most [ms].
        stable: Whether the force rests, or its oscillation decays, below the device's limit.
        rest: Whether the force rests, is slow, or is unstable.
        faults: Reasons for which the force was switched off during the demonstration.
    """

    model_config = ConfigDict(frozen=True)

    name: str
    felt_from_others_n: float | None
    truth_from_others_n: float | None
    force_error: float | None
    force_n: float | None
    truth_force_n: float | None
    k_o: float
    k_h: float
    max_stiffness: float
    soft: bool
    friction_needed: float | None
    loop_hz: float
    loop_late_p99_us: float
    loop_missed: int
    round_trip_ms: float
    felt_onset_ms: float | None
    felt_delay_ms: float | None
    felt_most_ms: float | None
    patch_hz: float | None
    patch_late_ms: float | None
    loop_stall_ms: float | None
    stable: bool | None
    rest: Rest | None
    faults: tuple[str, ...]


class DemoResult(BaseModel):
    """Result of a demonstration, with the settings of the scene."""

    model_config = ConfigDict(frozen=True)

    law: str
    simulation_hz: float
    delay_ms: float = Field(description="Injected, one way.")
    jitter_ms: float
    network: str = Field(description="Words for the whole injected link.")
    seed: int
    friction: float = Field(description="mu of every finger; 0 for none.")
    lag_ms: float = Field(
        description="In how long the object answers the others while the first presses."
    )
    presses: int = Field(description="Measured presses, or drags, of the first user.")
    late: Blame | None = Field(
        description="Why patches or periods of a loop came late while hands held still, if any did."
    )
    enough_s: float = Field(description="Duration in which every force can come to rest [s].")
    users: tuple[UserResult, ...]

    @property
    def least_felt(self) -> float | None:
        """Smaller part of the forces on the first two hands that is due to others [N].

        It is None in a demonstration too short for forces to rest, and in a scene with friction,
        whose forces along the surface are not those of a press.
        """
        parts = [user.felt_from_others_n for user in self.users[:2] if user.rest is not None]
        known = [abs(part) for part in parts if part is not None]
        return None if self.friction or len(known) < 2 else min(known)

    @property
    def shows_it(self) -> bool:
        """Whether no force is unstable, and the first two users feel each other at all.

        A demonstration that a busy machine or the link kept from being judged has not failed.
        """
        felt = self.least_felt
        unstable = any(user.stable is False for user in self.users)
        return not unstable and (felt is None or felt >= LEAST)

    @property
    def proves_it(self) -> bool:
        """Whether besides every force was judged, came to rest, and is close to its truth."""
        errors = [user.force_error for user in self.users if user.force_error is not None]
        rests = all(user.rest is Rest.RESTS for user in self.users)
        return self.shows_it and rests and max(errors, default=0.0) <= GOOD_ERROR


# Above 60 lines: half of them name the results.
def evaluate(
    scene: Scene,
    body: Body,
    recordings: Sequence[Path],
    statuses: Sequence[TouchStatus],
    faults: dict[str, set[str]],
) -> DemoResult:
    """Return the result of a demonstration, from the recordings of all users.

    Args:
        scene: Scene that the users performed.
        body: Touched body, at rest.
        recordings: Path of each user's recording, in the order of the scene's names.
        statuses: Last status of each user.
        faults: Faults of each user, by name.
    """
    loaded = [Recording.load(path) for path in recordings]
    timeline = Timeline.of(loaded)
    expected = 0.5 * scene.rhythm.period - scene.rhythm.ramp
    pressed = stretches(timeline, pressed=True, expected=expected)
    off = stretches(timeline, pressed=False, expected=expected)
    windows = press_windows(timeline, injected=2.0 * scene.link.longest)
    held = [*pressed, *off]
    late, blamed = _late(scene, loaded, timeline, held)
    parts = [part_on_time(loaded, timeline.t, s, 1.0 / scene.simulation_hz) for s in held]
    always = _always_on_time(scene, loaded)
    rests = _rests(scene, timeline, pressed, off, parts, always=always)
    # Where something came late a force need not be where it rests; if that is all, it has to do.
    punctual = [s for s, part in zip(held, parts, strict=True) if part == s]
    pressed = [s for s in pressed if s in punctual] or pressed
    off = [s for s in off if s in punctual] or off
    compared = compare(scene, body, timeline, pressed, off, windows)
    users = tuple(
        _user(
            name,
            compared[i],
            statuses[i],
            tuple(sorted(faults.get(name, ()))),
            rests[i],
            k_h=float(timeline.columns["k_h"][i, -1]) if timeline.t.size else 0.0,
            patch_hz=patch_rate(timeline, i),
            late=limit(late[i]),
            punctual=always,
        )
        for i, name in enumerate(scene.names)
    )
    return DemoResult(
        law=scene.law.value,
        simulation_hz=scene.simulation_hz,
        delay_ms=1e3 * scene.link.delay,
        jitter_ms=1e3 * scene.link.jitter,
        network=words_for(scene.link),
        seed=scene.seed,
        friction=scene.friction,
        lag_ms=1e3 * _lag(timeline, pressed, statuses),
        presses=len(pressed),
        late=next((b for b in (Blame.MACHINE, Blame.LINK) if b in blamed), None),
        # If no whole press fits into that duration, the machine is slow and needs a longer one.
        enough_s=max(scene.enough, 0.0 if pressed else 1.5 * (scene.duration or 0.0)),
        users=users,
    )


def _always_on_time(scene: Scene, loaded: Sequence[Recording]) -> bool:
    """Return whether everything came on time in all of the demonstration, also while hands move."""
    period = 1.0 / scene.simulation_hz
    whole = limit([lateness(recording, -math.inf, math.inf, period) for recording in loaded])
    return whole.blame(period, scene.link.wavers) is None


def _late(
    scene: Scene, loaded: Sequence[Recording], timeline: Timeline, held: Sequence[slice]
) -> tuple[list[list[Lateness]], list[Blame | None]]:
    """Return the lateness of each user in each stretch, and what it is blamed on in each stretch.

    Without a stretch, as where hands were thrown, the whole demonstration stands for it.
    """
    period = 1.0 / scene.simulation_hz
    late = in_stretches(loaded, timeline.t, held or [slice(0, timeline.t.size)], period)
    return late, [
        limit(of_all).blame(period, scene.link.wavers) for of_all in zip(*late, strict=True)
    ]


def _rests(
    scene: Scene,
    timeline: Timeline,
    pressed: Sequence[slice],
    off: Sequence[slice],
    parts: Sequence[slice | None],
    *,
    always: bool,
) -> list[Rest | None]:
    """Return a verdict on each hand's force; None if no press shows how it ends.

    Args:
        parts: Part of each stretch in which all came on time: of `pressed`, then of `off`.
        always: Whether everything came on time in all of the demonstration.
    """
    split = len(pressed)
    of_pressed, of_off = (
        judge(timeline.force, stretches, on_time, measured)
        for stretches, on_time in ((pressed, parts[:split]), (off, parts[split:]))
    )
    tops = [reaches_limit(row, parts, MAX_FORCE, always=always) for row in timeline.force]
    rests = [
        Rest.UNSTABLE if top else None if p is None else worst((p, o))
        for p, o, top in zip(of_pressed, of_off, tops, strict=True)
    ]
    if scene.duration is None or scene.duration >= scene.enough:
        return rests
    # In a shortened rhythm the first swing of a press looks like an undamped oscillation, and every
    # force seems to creep. Only two verdicts hold: the force rests, or is at the limit.
    return [r if r is Rest.RESTS or top else None for r, top in zip(rests, tops, strict=True)]


def _lag(timeline: Timeline, pressed: Sequence[slice], statuses: Sequence[TouchStatus]) -> float:
    """Return the room's lag while the first hand presses; at the end if it never does [s]."""
    if not pressed:
        return max(status.lag for status in statuses)
    return max(float(timeline.columns["lag"][:, measured(stretch)].max()) for stretch in pressed)


def _user(
    name: str,
    compared: Compared,
    status: TouchStatus,
    faults: tuple[str, ...],
    rest: Rest | None,
    *,
    k_h: float,
    patch_hz: float,
    late: Lateness,
    punctual: bool,
) -> UserResult:
    if any("the hand moved" in fault for fault in faults):
        rest = Rest.UNSTABLE if punctual else None
    return UserResult(
        name=name,
        felt_from_others_n=_known(compared.felt),
        truth_from_others_n=_known(compared.reference),
        force_error=_known(compared.error),
        force_n=_known(compared.force),
        truth_force_n=_known(compared.reference_force),
        k_o=status.k_o,
        k_h=k_h,
        max_stiffness=status.max_stiffness,
        soft=status.soft,
        friction_needed=_known(compared.friction_needed),
        loop_hz=status.loop_hz,
        loop_late_p99_us=1e6 * status.loop_late_p99,
        loop_missed=status.loop_missed,
        round_trip_ms=1e3 * status.round_trip,
        felt_onset_ms=_known(1e3 * compared.late.onset),
        felt_delay_ms=_known(1e3 * compared.late.half),
        felt_most_ms=_known(1e3 * compared.late.limit),
        patch_hz=_known(patch_hz),
        patch_late_ms=_known(1e3 * late.patch),
        loop_stall_ms=_known(1e3 * late.stall),
        stable=None if rest is None else rest is not Rest.UNSTABLE,
        rest=rest,
        faults=faults,
    )


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
