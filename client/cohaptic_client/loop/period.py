"""One period of the loop while it is computed: the only thing that changes, for a millisecond.

A period begins with the memory of the last one, the sample of the device and a budget. The rules of
`chain.py` fill it in, each by what the rules before it have left there. In the end it is the
result: it holds the force for the device, and all that memory and ledger are made from.
"""

from __future__ import annotations

import math
from typing import Final

from cohaptic.control.friction import NO_FRICTION, Compliance3, FrictionState, anchor_of
from cohaptic.control.geometry import Sight
from cohaptic.control.laws.model import NO_FORCE, LocalForce
from cohaptic.protocol.frame import MAX_POSITION
from cohaptic.vec import ZERO, Vec3, dot, norm
from cohaptic_client.devices.device import DeviceSample
from cohaptic_client.loop.budget import Budget
from cohaptic_client.loop.law_fade import LawFade
from cohaptic_client.loop.passivity import NOTHING_OWED, Passivity
from cohaptic_client.loop.replica import NOT_MOVED, Answer, Recent, Replica
from cohaptic_client.loop.safety import (
    EXTERNAL_RATE,
    NO_TROUBLE,
    SAFETY_FADE_RATE,
    SafetyState,
    Trouble,
)
from cohaptic_client.loop.state import LoopSettings, LoopState
from cohaptic_client.loop.trust import Trust

_NONE_ADDED: Final = list[float]()  # one for all periods; a rule that adds makes its own


class Period:
    """One period; without a surface the fields of the contact stay as they begin.

    Fields:
        state: Memory after the last period, with the patch whose time has come.
        sample: What the device says; the place of the last period where it is out of reach.
        now: Time [s].
        settings: Settings of the loop.
        dt: Time since the last period [s].
        counted: The same, at most two haptic periods, for all that moves the force: a late period
            moves it by no more than two punctual ones would [s].
        budget: Change of the force that the hand's own motion does not cause.

        trouble: Fault of the device; `NO_TROUBLE` for none.
        silent: Whether the server counts as silent.
        fraction: Completed fraction of the move to the newest patch, 0 to 1.
        sight: Sample of the shown surface at the probe; None before the first patch.

        answered: What the models of the others answer; None where there are none.
        recent: Speed of the hand of late, for the models.
        model_change: Change of the depth by models, which no limit may hold back [m].
        wished: Change of the depth by what others want, within its limit [m].

        fade: Law in use; None before the first patch.
        k_wanted: Gain that the surface asks for [N/m].
        k_h: Largest gain of the laws in use [N/m].
        fade_limit, law_fade_limit: Largest changes of the force by a fade of the safety layer, and
            by the transition from one law to the next [N].
        damping_limit: Largest change of the damping of a slow hand [N s/m].
        compliance: Compliance matrix C of the contact [m/N]; None without friction.
        for_friction: Part of the budget that friction has [N].
        normal: Direction of the normal force; a unit vector.
        moved: Displacement of the hand in this period [m].
        moved_in: Component of that displacement into the surface [m].
        depth: Depth of the probe below the surface, slewed as `LoopState.depth` is [m].
        max_change: Largest change of the law's force that the hand's own motion does not cause [N].
        spent_gain, spent_fades, spent_turn, spent_models, spent_depth: Taken of the budget, each by
            its rule [N].

        law_depth: Depth on which the law presses [m].
        law_normal: Normal force of our law, where a law of another package may replace it [N].
        local: Force of the law, with its parts.
        damping: Damping of the passivity layer [N s/m].
        damped_force: Normal force with that damping [N].
        friction: State of the friction after this period.
        law_force: Force of law and friction, whose opposite the body gets [N].
        asked: Force of law, friction and damping, and of rules of other packages [N].
        added: What each rule of another package added to its size [N].
        added_size: Sum of that, but for a law [N].
        added_stiffness: Most by which such rules change the force with the hand's place, beyond
            the law [N/m].
        added_damping: The same with the hand's speed [N s/m].
        memories: Memories of such rules.

        let_go: Whether a fault takes the force away.
        engaged: Whether the hand is engaged.
        quiet: Number of successive periods in which little was asked for.
        scale: Fraction of the clamped force that the hand gets, 0 to 1.
        safety: Memory of the safety layer after this period.
        force: Force on the hand, for the device; each rule of the guard replaces it [N].
        given_ratio: Its size, divided by that of the one that was asked for.
        passivity: Memory of the passivity layer after this period.
        on_body: Force on the hand whose opposite the body gets [N].
        replica: Models after this period; None before the first patch with partners.
        deflection: Displacement of the own hand's model before this period's force [m]; None
            without one.
        trust: How far models are trusted after this period.
    """

    # With slots Python reads and writes so many fields more quickly.
    __slots__ = (
        "added",
        "added_damping",
        "added_size",
        "added_stiffness",
        "answered",
        "asked",
        "budget",
        "compliance",
        "counted",
        "damped_force",
        "damping",
        "damping_limit",
        "deflection",
        "depth",
        "dt",
        "engaged",
        "fade",
        "fade_limit",
        "for_friction",
        "force",
        "fraction",
        "friction",
        "given_ratio",
        "k_h",
        "k_wanted",
        "law_depth",
        "law_fade_limit",
        "law_force",
        "law_normal",
        "let_go",
        "local",
        "max_change",
        "memories",
        "model_change",
        "moved",
        "moved_in",
        "normal",
        "now",
        "on_body",
        "passivity",
        "quiet",
        "recent",
        "replica",
        "safety",
        "sample",
        "scale",
        "settings",
        "sight",
        "silent",
        "spent_depth",
        "spent_fades",
        "spent_gain",
        "spent_models",
        "spent_turn",
        "state",
        "trouble",
        "trust",
        "wished",
    )

    # Above 60 lines: one for each field, as slots have no other place for how they begin.
    def __init__(
        self, state: LoopState, sample: DeviceSample, now: float, settings: LoopSettings
    ) -> None:
        self.state: LoopState = state
        self.sample: DeviceSample = sample
        self.now: float = now
        self.settings: LoopSettings = settings
        before = state.safety.now
        self.dt: float = 0.0 if before is None else max(0.0, now - before)
        self.counted: float = min(self.dt, 2.0 * settings.limits.period)
        self.budget: Budget = Budget(EXTERNAL_RATE * self.counted)
        self.safety: SafetyState = state.safety
        self.replica: Replica | None = state.replica
        self.trust: Trust = state.trust
        self.trouble: Trouble = NO_TROUBLE
        self.silent: bool = True
        self.fraction: float = 0.0
        self.sight: Sight | None = None
        self.answered: Answer | None = None
        self.recent: Recent = NOT_MOVED
        self.model_change: float = 0.0
        self.wished: float = 0.0
        self.fade: LawFade | None = None
        self.k_wanted: float = 0.0
        self.k_h: float = 0.0
        self.compliance: Compliance3 | None = None
        self.for_friction: float = 0.0
        self.normal: Vec3 = (0.0, 0.0, 1.0)
        self.moved: Vec3 = ZERO
        self.moved_in: float = 0.0
        self.depth: float = -math.inf
        self.max_change: float = 0.0
        self.fade_limit: float = SAFETY_FADE_RATE * self.counted
        self.law_fade_limit: float = 0.0
        self.damping_limit: float = math.inf
        self.spent_gain: float = 0.0
        self.spent_fades: float = 0.0
        self.spent_turn: float = 0.0
        self.spent_models: float = 0.0
        self.spent_depth: float = 0.0
        self.law_depth: float = 0.0
        self.law_normal: float = 0.0
        self.local: LocalForce = NO_FORCE
        self.damping: float = 0.0
        self.damped_force: float = 0.0
        self.friction: FrictionState = NO_FRICTION
        self.law_force: Vec3 = ZERO
        self.asked: Vec3 = ZERO
        self.added: list[float] = _NONE_ADDED
        self.added_size: float = 0.0
        self.added_stiffness: float = 0.0
        self.added_damping: float = 0.0
        self.memories: tuple[object, ...] = state.memories
        self.let_go: bool = False
        self.engaged: bool = False
        self.quiet: int = 0
        self.scale: float = 0.0
        self.force: Vec3 = ZERO
        self.given_ratio: float = 0.0
        self.passivity: Passivity = NOTHING_OWED
        self.on_body: Vec3 = ZERO
        self.deflection: float | None = None

    @property
    def damping_force(self) -> float:
        """Damping force of the passivity layer, along the normal [N]."""
        return self.damped_force - self.local.normal_force

    @property
    def u_others(self) -> float:
        """Displacement of the contact point by the other users, along the normal [m]."""
        return 0.0 if self.sight is None else dot(self.sight.u_others, self.sight.normal)

    @property
    def anchor(self) -> Vec3 | None:
        """Point of the resting surface to which friction holds the contact [m]; None for none."""
        if not self.friction.touching:
            return None
        anchor = anchor_of(self.friction, self.sample.position, self.normal, self.depth)
        if anchor is None or not norm(anchor) <= MAX_POSITION:  # NaN too
            return None
        return anchor

    def take_force_away(self) -> None:
        """Let hand and body have no force, after the device has been released."""
        self.force, self.on_body, self.friction = ZERO, ZERO, NO_FRICTION
