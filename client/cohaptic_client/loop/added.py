"""Runs rules of other packages in the chain (`added_rule.py` is what they are).

A law runs in place of the rule `law`, and any other rule changes the force after friction. What a
rule raises takes the force away, as a fault of the law does; a force that is none does, too.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any, Final

from cohaptic.control.geometry import Sight
from cohaptic.control.law import DEFAULT_LAW, Law, pressed_depth
from cohaptic.control.laws.model import LocalForce, depth_alone
from cohaptic.errors import SettingError
from cohaptic.extensions import ExtensionError, adder, load
from cohaptic.extensions import added as names_of
from cohaptic.status.row import COLUMNS, MAX_RULES
from cohaptic.vec import Vec3, dot, norm, scale
from cohaptic_client.loop.added_rule import AddedRule
from cohaptic_client.loop.chain import CHAIN
from cohaptic_client.loop.law_fade import LawFade
from cohaptic_client.loop.period import Period
from cohaptic_client.loop.rule import Rule, RuleError
from cohaptic_client.loop.rules.contact import held

GROUP: Final = "cohaptic.rules"


class Contact:
    """What a rule of another package sees of a period, and may change of it.

    Attributes:
        depth: Depth of the tip below the surface on which the law presses, 0 above it [m]. For
            `predictive` that surface is free of the hand's own dent.
        k_o: Stiffness of the object there [N/m].
        k_h: Gain in use, on which a law should rest: it follows `k_o` slowly enough for a hand, and
            is no larger than the device renders [N/m].
        integral_gain: Integral gain that the server chose; 0 but for `pi` [N/(m s)].
        normal: Direction of the normal force, a unit vector out of the object.
        tip: Position of the tip in the world frame, z up [m].
        velocity: Velocity of the tip [m/s].
        speed_in: Speed of the tip into the surface [m/s].
        moved_in: Displacement of the tip into the surface in this period [m].
        budget: By how much the force may change in this period beyond what the hand's own motion
            explains; a memory that moves the force by more runs ahead of it [N].
        dt: Time since the last period, at most two haptic periods [s].
        force: Force on the hand so far, three numbers in the world frame, along `normal` where it
            pushes the hand out; for a law the spring `k_h depth` [N]; a rule sets another.
        added_stiffness: Most by which this rule changes the force with the hand's place, beyond the
            law's gain, 0 at the beginning of each period [N/m]. What no stiffness explains moves
            the force as slowly as others may.
        added_damping: The same with the hand's speed [N s/m].
    """

    # Copies, and not the period: what a rule keeps of it keeps nothing else alive.
    def __init__(self, period: Period, sight: Sight) -> None:
        fade = period.fade
        law = DEFAULT_LAW if fade is None else fade.now.law
        self.depth: float = max(0.0, pressed_depth(law, sight))
        self.k_o: float = 1.0 / sight.c_ii
        self.k_h: float = 0.0 if fade is None else fade.now.gains.k_h
        self.integral_gain: float = 0.0 if fade is None else fade.now.gains.integral_gain
        self.normal: Vec3 = period.normal
        self.tip: Vec3 = period.sample.position
        self.velocity: Vec3 = period.sample.velocity
        self.speed_in: float = -dot(self.normal, self.velocity)
        self.moved_in: float = period.moved_in
        self.budget: float = period.max_change
        self.dt: float = period.counted
        self.force: Vec3 = period.asked
        self.added_stiffness: float = 0.0
        self.added_damping: float = 0.0

    def press(self, normal_force: float) -> None:
        """Press with a normal force, as a law does [N]; a surface never pulls."""
        self.force = scale(self.normal, 0.0 if normal_force <= 0.0 else normal_force)  # NaN stays


def _report(error: BaseException) -> str:
    """Return an error in words, whatever it does when it is asked."""
    try:
        return f"{type(error).__name__}: {error}"
    except BaseException:
        return type(error).__name__


class Added(Rule):
    """Runs a rule of another package: a limit, or a filter.

    Fields:
        rule: The rule.
        slot: Place of its memory and of its entry in the ledger.
    """

    rule: Final[Any]
    slot: Final[int]

    def __init__(self, rule: Any, slot: int) -> None:
        super().__init__(str(rule.name), str(rule.reason))
        self.rule = rule
        self.slot = slot

    def apply(self, period: Period) -> None:
        """Replace `asked`, and what follows from it.

        Raises:
            RuleError: The rule fails.
        """
        if period.sight is None:
            return
        before = norm(period.asked)
        period.asked = self.ask(period, held(period, period.sight))
        size = norm(period.asked)
        period.added_size += size - before
        # What the hand does not feel, nobody else should.
        if before > 0.0:
            period.law_force = scale(period.law_force, min(1.0, size / before))
        self.enter(period, size - before)

    def ask(self, period: Period, sight: Sight) -> Vec3:
        """Return the force that the rule wants, and keep its memory [N].

        Args:
            sight: Surface that the hand meets.

        Raises:
            RuleError: The rule fails.
        """
        contact = Contact(period, sight)
        memories = list(period.memories)
        while len(memories) <= self.slot:
            memories.append(None)
        memory = memories[self.slot]
        try:
            memory = self.rule.apply(self.rule.begin() if memory is None else memory, contact)
            x, y, z = (float(value) for value in contact.force)
            stiffness, damping = float(contact.added_stiffness), float(contact.added_damping)
        except BaseException as error:  # foreign code may raise anything
            raise RuleError(f"the rule {self.name} raised {_report(error)}") from None
        if memory is None:
            raise RuleError(f"the rule {self.name} returned no memory: apply and begin return one")
        if not math.isfinite(x + y + z):
            raise RuleError(f"the rule {self.name} asked for {contact.force} N")
        if not (0.0 <= stiffness < math.inf and 0.0 <= damping < math.inf):
            problem = f"an added stiffness of {stiffness} N/m and damping of {damping} N s/m"
            raise RuleError(f"the rule {self.name} said {problem}; they are 0 or more")
        memories[self.slot] = memory
        period.memories = tuple(memories)
        period.added_stiffness += stiffness
        period.added_damping += damping
        return x, y, z

    def enter(self, period: Period, newtons: float) -> None:
        """Enter into the ledger by how much the rule changes the size of the force [N]."""
        while len(period.added) <= self.slot:
            period.added = [*period.added, 0.0]
        period.added[self.slot] = newtons


class AddedLaw(Added):
    """Runs a law of another package in place of the one of the wire."""

    def apply(self, period: Period) -> None:
        """Fill in what `law` fills in; a change of the law of the wire is at once.

        Raises:
            RuleError: The rule fails.
        """
        sight, fade = period.sight, period.fade
        if sight is None or fade is None:
            return
        surface = held(period, sight)
        k_h, pressed = fade.now.gains.k_h, pressed_depth(fade.now.law, surface)
        # What it stores is not known: the passivity layer reckons with the spring of the gain.
        spring = k_h * max(0.0, pressed)
        period.fade = LawFade(fade.now)
        period.law_depth, period.law_normal = surface.depth, spring
        period.asked = scale(period.normal, spring)
        force = self.ask(period, surface)
        normal_force = max(0.0, dot(force, period.normal))
        if not math.isfinite(normal_force):
            raise RuleError(f"the rule {self.name} asked for {force} N")
        alone = depth_alone(surface) / surface.depth if surface.depth > 0.0 else 0.0
        period.local = LocalForce(
            normal_force, normal_force * (1.0 - alone), surface.c_ii * normal_force,
            0.5 * spring * max(0.0, pressed),
        )  # fmt: skip
        period.damped_force = normal_force
        period.asked = period.law_force = scale(period.normal, normal_force)
        self.enter(period, normal_force - spring)


RuleChoice = str | AddedRule  # name of an entry point, or a rule of a script


def check_rules(rules: tuple[RuleChoice, ...], law: Law = DEFAULT_LAW) -> None:
    """Check that rules are installed, and may be in one loop.

    Args:
        rules: Names of entry points, or rules of a script.
        law: Law of the wire.

    Raises:
        SettingError: There is no such rule, they do not go together, or a rule of a script is none.
        ExtensionError: A rule cannot be loaded, or its name names no column of a recording.
    """
    if len(rules) > MAX_RULES:
        raise SettingError(
            "--rule", f"given {len(rules)} times", f"given {MAX_RULES} times at most"
        )
    for rule in rules:
        if isinstance(rule, str) and rule not in names_of(GROUP):
            alike = [each for each in names_of(GROUP) if each.replace("-", "_") == rule]
            known = ", ".join(alike or names_of(GROUP))
            known = known or "there is none; a package in the same Python brings them"
            raise SettingError("--rule", repr(rule), f"one that is installed: {known}")
        if problem := _problem(load_rule(rule)):
            if isinstance(rule, str):
                raise ExtensionError(GROUP, rule, adder(GROUP, rule), problem)
            raise SettingError("rule of a script", type(rule).__name__, f"another: {problem}")
    loaded = [load_rule(rule) for rule in rules]
    names = ", ".join(rule.name for rule in loaded)
    if len({rule.name for rule in loaded}) < len(rules):
        raise SettingError("--rule", names, "rules of different names, each given once")
    laws = [rule for rule in loaded if rule.is_law]
    if len(laws) > 1:
        raise SettingError("--rule", names, "at most one law among them")
    for rule in laws:
        place = place_of(rule)
        if place != law.value:
            raise SettingError("--law", law.value, f"{place}, whose place {rule.name} takes")


def _problem(rule: Any) -> str:
    """Return why a rule cannot be in a loop; empty if it can."""
    own = str(rule.name)
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,30}", own):
        return f"its name is {own!r}, and must be small letters, digits and _, at most 31"
    if {own, f"by_{own}"} & {*COLUMNS}:
        return f"its name is {own!r}, as a column of recordings is; it must be another"
    if place_of(rule) not in {each.value for each in Law}:
        ours = ", ".join(each.value for each in Law)
        return f"its in_place_of is {place_of(rule)!r}, and must be one of {ours}"
    return ""


def place_of(rule: Any) -> str:
    """Return the name of the law of the wire in whose place a law of a package presses."""
    return str(getattr(rule, "in_place_of", DEFAULT_LAW.value))


def reasons_of(rules: tuple[RuleChoice, ...]) -> dict[str, str]:
    """Return the names and reasons of rules, for a recording.

    Args:
        rules: Names of entry points, or rules of a script.
    """
    return {rule.name: str(rule.reason) for rule in map(load_rule, rules)}


def load_rule(choice: RuleChoice) -> Any:
    """Return the rule of an entry point; a rule of a script is returned as it is.

    Raises:
        SettingError: A script has given something else than an instance of `AddedRule`.
        ExtensionError: It cannot be loaded, or is no `AddedRule`.
    """
    if not isinstance(choice, str):
        found: Any = choice  # a script is not checked for its types
        if isinstance(found, type) or not isinstance(found, AddedRule):
            limit = "an instance with name, reason, is_law, begin() and apply(memory, contact)"
            raise SettingError("rule of a script", repr(choice)[:80], limit)
        return choice
    rule = load(GROUP, choice, AddedRule)  # type: ignore[type-abstract]
    if isinstance(rule, type):
        problem = f"it is the class {rule.__name__}, and must be an instance: {rule.__name__}()"
        raise ExtensionError(GROUP, choice, adder(GROUP, choice), problem)
    return rule


def chain_with(rules: Sequence[RuleChoice]) -> tuple[Rule, ...]:
    """Return the chain with rules of other packages.

    Args:
        rules: Names of their entry points or rules of a script, in the order in which they act.

    Raises:
        ExtensionError: A rule cannot be loaded.
    """
    return with_rules([load_rule(rule) for rule in rules])


def with_rules(rules: Sequence[AddedRule]) -> tuple[Rule, ...]:
    """Return the chain with rules, in the order in which they act."""
    laws, others, chain = list[Rule](), list[Rule](), list[Rule]()
    for slot, rule in enumerate(rules):
        if rule.is_law:
            laws.append(AddedLaw(rule, slot))
        else:
            others.append(Added(rule, slot))
    for own in CHAIN:
        chain += laws if laws and own.name == "law" else [own]
        if own.name == "friction":
            chain += others
    return tuple(chain)
