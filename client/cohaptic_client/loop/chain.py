"""All that happens to a force in one period of the haptic loop, in order.

Each rule has its name, what it does and why, and the constant with which it works. What a rule did
in a period is in the period's ledger. Rules of other packages (`added.py`) come behind `law`, if
they are laws, and else behind `friction`.
"""

from __future__ import annotations

from typing import Final

from cohaptic_client.loop.rule import Rule
from cohaptic_client.loop.rules.contact import Compliance, Depth, Gain, Reserve, Turn
from cohaptic_client.loop.rules.force import Damping, Finite, Friction, LawForce
from cohaptic_client.loop.rules.given import Account, ToBody, Trusted
from cohaptic_client.loop.rules.guard import Fade, Fault, Limit, Rate
from cohaptic_client.loop.rules.surface import Models, Reach, Shown

FAULT: Final = Fault(
    "fault",
    "after a pause of the loop, with a hand that is too fast or a device that fails, the force "
    "is taken away on a smooth ramp",
    "FAULT_RELEASE_TIME s",
)
CHAIN: Final[tuple[Rule, ...]] = (
    Reach(
        "reach",
        "a tip that is nowhere, or jumps faster than a hand, is a broken sensor: the hand is "
        "let go",
        "SafetyLimits.max_speed m/s",
    ),
    Shown(
        "surface",
        "the shown surface moves from patch to patch all the time: one that comes in one step "
        "would step the force",
        "LoopSettings.smoothing",
    ),
    Models(
        "models",
        "models of the others' hands answer at once, since late answers make energy; what the "
        "others want is held back",
        "WISH_RATE N/s",
    ),
    Reserve(
        "reserve",
        "parts of the budget are reserved first for what later rules change by themselves: a fade "
        "of the force, a change of law, the damping of a slow hand",
        "SAFETY_FADE_RATE N/s",
    ),
    Gain(
        "gain",
        "the gain follows the object's stiffness slowly: a finger that slides from soft to stiff "
        "must not be kicked",
        "GAIN_RATE 1/s",
    ),
    Compliance(
        "compliance",
        "the compliance in all directions, which friction needs, follows the object's slowly; half "
        "of what is left of the budget is kept for friction",
    ),
    Turn(
        "turn",
        "a surface that turns may turn the force with half of what is left: a turn is a change",
        "EXTERNAL_RATE N/s",
    ),
    Depth(
        "depth",
        "the surface moves the force with the rest of the budget: 0.02 N in a millisecond is no "
        "jolt",
        "EXTERNAL_RATE N/s",
    ),
    LawForce("law", "the law turns depth into force"),
    Damping(
        "damping",
        "energy that the network has made is taken out, no more than the device renders",
        "MAX_DAMPING N s/m",
    ),
    Friction("friction", "friction is at most mu times the normal force"),
    Finite(
        "finite",
        "a law or a rule that gives a force that no spring can give has failed: the hand is let go",
    ),
    FAULT,
    Limit(
        "limit",
        "the force is at most the limit of the device or of its user",
        "SafetyLimits.max_force N",
    ),
    Fade(
        "fade",
        "a hand is engaged out of the object only, over a second; while the server is silent its "
        "force fades, and it returns as slowly",
        "SAFETY_FADE_RATE N/s",
    ),
    Rate(
        "rate",
        "the force changes no faster than a hand that taps makes it, and without the hand no "
        "faster than the budget",
        "LEAST_RATE N/s",
    ),
    Account("account", "the energy that the network makes is counted, to be damped out"),
    ToBody(
        "body",
        "the body gets the law's force in the share that the hand was given, and the models move "
        "on by it",
    ),
    Trusted(
        "trust",
        "the energy that the contact returns beyond that of the hand is counted, and where it is "
        "too much, models lose their share: a liar could drive a hand by them",
        "MAX_MADE J",
    ),
)
