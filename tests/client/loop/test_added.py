"""Rules of other packages in the chain: what they may do, and what nobody may."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import settings as tried
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic.control.laws.model import LawSettings
from cohaptic.protocol.patch import Patch
from cohaptic.recording.why import entries_in, why
from cohaptic.vec import ZERO, Vec3, norm, scale, sub
from cohaptic_client.loop.added import Contact, place_of, with_rules
from cohaptic_client.loop.arrival import receive
from cohaptic_client.loop.chain import CHAIN
from cohaptic_client.loop.rules.force import AHEAD
from cohaptic_client.loop.safety import BACKSTOP, EXTERNAL_RATE, Mode, SafetyLimits
from cohaptic_client.loop.state import LoopSettings
from cohaptic_client.loop.step import step
from tests.client.loop.loop_cases import PERIOD, SETTINGS, TICK, engaged, near_patches, samples
from tests.client.loop.staged import DEPTH, Stage, honest
from tests.client.plane import STIFFNESS
from tests.examples_of_laws import examples

PRESSED = STIFFNESS * DEPTH  # N
EXAMPLES = Path(__file__).parents[3] / "examples/plugin/cohaptic_example"


@dataclass
class OwnHand:
    """A rule that does what a function says."""

    act: Callable[[Contact], None]
    is_law: bool = False
    name: str = "own"
    reason: str = "as a test wants it"

    def begin(self) -> int:
        return 0

    def apply(self, memory: int, contact: Contact) -> int:
        self.act(contact)
        return memory + 1


class Forgets(OwnHand):
    """A rule that does not return its memory."""

    def apply(self, memory: int, contact: Contact) -> int:
        super().apply(memory, contact)
        return None  # type: ignore[return-value]


def example(name: str) -> Any:
    """The rule in a file of the example's package."""
    space: dict[str, Any] = {"__name__": name}
    exec(compile((EXAMPLES / f"{name}.py").read_text(encoding="utf-8"), name, "exec"), space)
    return space["RULE"]


def weighed(contact: Contact) -> None:
    contact.force = scale(contact.force, 0.5)


def staged(*rules: Any) -> Stage:
    settings = LoopSettings(TICK, SafetyLimits())  # the passivity layer would hide what rules do
    return Stage(settings, with_rules(rules))


def given_and_told(stage: Stage) -> dict[str, float]:
    """The entries of the last period by name, which add up to the force."""
    found = why(stage.columns(), stage.length)
    assert sum(entry.newtons for entry in found.entries) == pytest.approx(found.force, abs=1e-9)
    return {entry.name: entry.newtons for entry in found.entries}


def test_four_rules_act_one_after_the_other() -> None:
    stage = staged(*(OwnHand(weighed, name=f"own_{i}") for i in range(4)))
    stage.press()
    reported = given_and_told(stage)
    assert [reported[f"own_{i}"] for i in range(4)] == pytest.approx(
        [-0.5 * PRESSED, -0.25 * PRESSED, -0.125 * PRESSED, -0.0625 * PRESSED]
    )
    assert list(entries_in(stage.columns())).index("by_own_3") < list(
        entries_in(stage.columns())
    ).index("by_limit")


def test_a_law_takes_the_place_of_ours() -> None:
    stage = staged(OwnHand(lambda contact: contact.press(0.3 * contact.k_h * contact.depth), True))
    stage.press()
    assert norm(stage.last.force) == pytest.approx(0.3 * PRESSED)
    assert given_and_told(stage)["own"] == pytest.approx(-0.7 * PRESSED)


def raises(contact: Contact) -> None:
    raise RuntimeError("no licence")


def no_number(contact: Contact) -> None:
    contact.force = (math.nan, 0.0, 0.0)


def too_large(contact: Contact) -> None:
    contact.force = (1e300, 0.0, 1e300)


def of_two(contact: Contact) -> None:
    contact.force = (1.0, 2.0)  # type: ignore[assignment]


@pytest.mark.parametrize("act", [raises, no_number, too_large, of_two])
@pytest.mark.parametrize("is_law", [False, True])
def test_a_rule_that_fails_lets_the_hand_go(act: Callable[[Contact], None], is_law: bool) -> None:
    stage = Stage()
    stage.press()
    assert norm(stage.last.force) > 1.0
    stage.chain = with_rules([OwnHand(act, is_law)])
    stage.rest(0.1)
    assert stage.last.force == ZERO
    fault = stage.state.safety.fault
    assert fault.startswith("the law failed: " if act is too_large else "the rule own ")
    if act is raises:
        assert fault == "the rule own raised RuntimeError: no licence"
        assert "a rule of another package failed" in why(stage.columns(), stage.length).sentence


def presses_no_number(contact: Contact) -> None:
    contact.press(math.nan)


def too_large_for_one_number(contact: Contact) -> None:
    contact.force = (1e308, 1e308, 1e308)


class Mute(Exception):
    def __str__(self) -> str:
        raise TypeError


def says_nothing(contact: Contact) -> None:
    raise Mute


def leaves(contact: Contact) -> None:
    raise SystemExit(3)


def stiff_below_zero(contact: Contact) -> None:
    contact.added_stiffness = -1.0


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        (OwnHand(leaves), "raised SystemExit: 3"),
        (OwnHand(says_nothing), "raised Mute"),
        (OwnHand(presses_no_number), "asked for ("),
        (OwnHand(presses_no_number, is_law=True), "asked for ("),
        (OwnHand(too_large_for_one_number, is_law=True), "asked for ("),
        (OwnHand(stiff_below_zero), "said an added stiffness of -1.0 N/m"),
        (Forgets(weighed), "returned no memory"),
    ],
    ids=["leaves", "mute", "nan", "nan of a law", "inf", "stiff", "forgets"],
)
def test_a_mistake_of_a_rule_is_named(rule: OwnHand, words: str) -> None:
    stage = Stage()
    stage.press()
    stage.chain = with_rules([rule])
    stage.rest(0.1)
    assert stage.last.force == ZERO
    assert stage.state.safety.fault.startswith(f"the rule own {words}")


@given(st.lists(st.tuples(st.floats(-40.0, 40.0), st.floats(0.0, 1e9)), min_size=1, max_size=30))
@tried(max_examples=examples(60), deadline=None)
def test_no_rule_moves_a_hand_at_rest_faster_than_others_may(
    wanted: list[tuple[float, float]],
) -> None:
    """Whatever it asks for, and whatever it says to explain it with."""
    stage = staged()
    stage.press()
    asked = iter(wanted * 2)

    def act(contact: Contact) -> None:
        newtons, model_change = next(asked)
        contact.force = (newtons, 0.5 * newtons, 0.0)
        contact.added_stiffness = contact.added_damping = model_change

    stage.chain = with_rules([OwnHand(act)])
    for _ in wanted:
        before = stage.last.force
        stage.period(stage.tip)
        change = norm(sub(stage.last.force, before))
        assert change <= BACKSTOP * EXTERNAL_RATE * PERIOD + 1e-9
        assert norm(stage.last.force) <= 10.0 + 1e-9
        assert norm(stage.on_body) <= 10.0 + 1e-9


@pytest.mark.parametrize("depth", [0.002, 0.004])
def test_a_filter_engages_no_hand_inside_the_object(depth: float) -> None:
    """Its force begins at zero, however deep the hand is."""
    stage = staged(example("soften"))
    stage.tip = (0.0, 0.0, -depth)
    stage.rest(0.5)
    assert stage.last.force == ZERO
    stage.go((0.0, 0.0, 0.002), 0.1)
    stage.press()
    assert norm(stage.last.force) == pytest.approx(PRESSED, rel=1e-6)


def test_after_a_fault_a_hand_is_engaged_out_of_the_object_only() -> None:
    stage = staged(example("soften"))
    stage.press()
    chain, stage.chain = stage.chain, with_rules([OwnHand(raises)])
    stage.rest(0.05)
    stage.chain = chain
    stage.rest(0.5)
    assert stage.last.force == ZERO


@dataclass
class Spring(OwnHand):
    """`predictive` or `proportional`, as another package would write them."""

    act: Callable[[Contact], None] = lambda contact: contact.press(contact.k_h * contact.depth)
    is_law: bool = True
    in_place_of: str = "predictive"


class Integral(Spring):
    """`pi` as another package would write it, eqs. (12), (17), (18)."""

    def begin(self) -> Any:
        return 0.0, 0.0, 0.0  # force of the integral [N], its ramp [N/s], depth [m]

    def apply(self, memory: Any, contact: Contact) -> Any:
        (force, ramp, before), depth, k = memory, contact.depth, contact.k_h
        way, largest, ours = k * contact.moved_in, contact.budget, LawSettings()
        limit = ours.thresholds.entering
        if depth < before - 5e-3 * contact.dt:
            limit = ours.thresholds.leaving * min(1.0, force / ours.thresholds.full_force)
        grown = contact.integral_gain * (depth - limit) if depth > 0.0 else -ramp
        last, spring = k * before + force, k * depth
        low, high = last + min(0.0, way) - largest, last + max(0.0, way) + largest
        force = min(max(force + grown * contact.dt, low - spring), high - spring)
        force = min(max(force, 0.0), ours.max_force)
        contact.press(spring + force)
        return force, max(0.0 if depth > 0.0 else ramp, force / ours.release_time), depth


@given(
    st.sampled_from([Spring(), Spring(in_place_of="proportional"), Integral(in_place_of="pi")]),
    st.lists(st.tuples(near_patches, st.lists(samples, min_size=1, max_size=20)), min_size=1),
)
@tried(deadline=None)
def test_ours_are_written_by_what_a_stranger_sees(law: Spring, life: list[Any]) -> None:
    """Each law of the wire, from a contact alone, gives the force that ours gives."""
    place, settings, now = Law(law.in_place_of), SETTINGS, 10.0
    assert place_of(law) == law.in_place_of
    state = engaged(replace(life[0][0], law=place))
    states, chains = [state, state], [CHAIN, with_rules([law])]
    for tick, (patch, tips) in enumerate(life):
        seen = replace(patch, law=place, tick=tick + 2)
        states = [receive(each, seen, now, settings) for each in states]
        for sample in tips:
            forces = list[Vec3]()
            for i, chain in enumerate(chains):
                states[i], period = step(states[i], sample, now, settings, chain)
                forces.append(period.force)
            assert forces[1] == pytest.approx(forces[0], abs=1e-9)
            now += PERIOD


def test_a_limit_behind_pi_does_not_wind_its_integral_up() -> None:
    """An integral that grew to 9 N behind a limit of 1.2 N was felt 13 mm above the surface."""
    stage = staged()
    law = Law.PI

    def of_pi(patch: Patch, on_body: Vec3) -> Patch:
        return replace(honest(patch, on_body), law=law, k_h=0.3 * STIFFNESS, integral_gain=500.0)

    def cap(contact: Contact) -> None:
        contact.force = scale(contact.force, min(1.0, 1.2 / (norm(contact.force) or 1.0)))

    stage.server = of_pi
    stage.chain = with_rules([OwnHand(cap)])
    stage.press()
    stage.rest(4.0)
    assert norm(stage.last.force) == pytest.approx(1.2)
    assert norm(stage.last.asked) <= 1.2 + AHEAD + 1e-6
    assert stage.last.local.normal_force <= 1.2 + AHEAD + 0.05
    stage.go((0.0, 0.0, 0.001), 0.1)
    stage.rest(0.15)  # 0.1 s of release
    assert stage.last.force == ZERO


@pytest.mark.parametrize("law", list(Law))
def test_no_law_engages_a_hand_inside_the_object(law: Law) -> None:
    """A soft one asked for little 10 mm deep, and the hand was engaged there after a fault."""
    stage = staged()

    def of_law(patch: Patch, on_body: Vec3) -> Patch:
        return replace(honest(patch, on_body), law=law, k_h=0.02 * STIFFNESS)

    stage.server = of_law
    stage.tip = (0.0, 0.0, -DEPTH)
    stage.rest(0.5)
    assert stage.last.force == ZERO
    assert stage.state.safety.mode is Mode.WAITING
    stage.go((0.0, 0.0, 0.002), 0.1)
    stage.press()
    assert norm(stage.last.force) > 0.0


def test_a_law_in_place_of_pi_is_told_as_what_it_is() -> None:
    """The law whose place it takes does not run: neither dent nor ledger is of that one."""
    law = example("leaky")
    stage = staged(law)

    def of_pi(patch: Patch, on_body: Vec3) -> Patch:
        return replace(honest(patch, on_body), law=Law.PI, k_h=0.3 * STIFFNESS, integral_gain=500.0)

    stage.server = of_pi
    stage.press()
    reported = given_and_told(stage)
    force = norm(stage.last.force)
    assert force == pytest.approx(PRESSED, rel=0.2)
    assert stage.last.local.indentation == pytest.approx(force / STIFFNESS, rel=1e-6)
    assert "leaky" in reported
    assert all(abs(newtons) < 1.5 * PRESSED for newtons in reported.values())


@pytest.mark.parametrize("rules", [(), (OwnHand(weighed),), (OwnHand(weighed), Spring())])
def test_the_guard_is_whole_and_behind_all_that_is_added(rules: tuple[Any, ...]) -> None:
    """Without `fade` or `fault` a chain would give a force that nobody engaged or checked."""
    names = [rule.name for rule in with_rules(rules)]
    assert names[names.index("fault") :] == [
        "fault", "limit", "fade", "rate", "account", "body", "trust",
    ]  # fmt: skip
