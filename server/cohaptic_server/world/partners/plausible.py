"""What a hand can do, and whether a client tells more of its hand than that.

All that strangers tell of their hands passes here on its way to the others: the depth of the tip,
the displacement of its model, and the force with which a model of it may press. A hand is no
deeper than its device can press; one that is deeper than its force indents presses no harder for
it. Who tells the implausible is heard with the longest lag for a while, as without models.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from cohaptic_server.world.partners.learning import Learned
from cohaptic_server.world.partners.small_gain import LAGS
from cohaptic_server.world.state import Touch

# Largest deflection, in forces over the stiffness of a model: a resonance in full swing. The force
# is the largest that the hand has reported lately, so that a client cannot press with a deflection
# alone. Reasoned, not measured, as are the other numbers here; experiments/attacks has what liars
# do within them.
_MAX_DEFLECTION: Final = 2.0
# N more than a hand has told lately, for one that has just touched, and relative to its force: a
# hand on its way into the object is a sample ahead of the force that it told.
_MORE_FORCE: Final = 0.5
_FORCE: Final = 1.1
# A model presses with so much of the force that its hand has told lately and a newton [N] at most:
# a hand may be deep and press with nothing, as after a fault.
_MAX_REPORTED: Final = 1.25
_MAX_MORE: Final = 1.0
_FARTHEST: Final = 0.05  # m over the object; a hand farther away touches nothing soon
_FASTEST: Final = 1.5  # m/s, the speed at which a client's safety layer lets go
# Multiple of the depth that a force indents, and depth beyond [m], at which a hand is implausible:
# on stiff places the depth of a contact is known to a millimetre or so.
_DOUBTED: Final = 2.0
_DOUBTED_BEYOND: Final = 0.005


def deflection_of(touch: Touch, hand: Learned) -> float:
    """Return a client's deflection, as far as the forces that it reports can make it [m]."""
    force = min(touch.who.max_force, hand.peak + _MORE_FORCE)
    # Of the hand or of the model on its way to it, whichever presses less by such a deflection.
    stiffness = max(hand.model.stiffness, hand.wanted[0].stiffness if hand.reported else 0.0)
    limit = _MAX_DEFLECTION * force / stiffness
    return min(limit, max(-limit, touch.deflection or 0.0))


def strength(hand: Learned) -> float:
    """Return the largest force with which models of a hand press [N]."""
    return _MAX_REPORTED * hand.peak + _MAX_MORE


def depth_of(
    touch: Touch, hand: Learned, depth: float, compliance: float, push: float
) -> tuple[float, bool]:
    """Return how deep a hand is believed to be, and whether it told something implausible.

    A deep hand is not brought up to the depth that its own force indents: its client may still let
    the force come, and depths that follow forces make a loop that swings. What its models press
    with is limited by `strength`.

    Args:
        touch: Newest sample of the hand.
        hand: What is known of it.
        depth: Depth of the tip that it told, below the surface without its own force [m].
        compliance: Compliance of its contact and its device [m/N].
        push: Force into the object that it told; a force along the surface indents nothing [N].
    """
    force = min(touch.who.max_force, _FORCE * max(hand.peak, push) + _MORE_FORCE)
    doubted = depth > _DOUBTED * compliance * force + _DOUBTED_BEYOND
    return min(compliance * touch.who.max_force, max(-_FARTHEST, depth)), doubted


def moved(before: float, wanted: float, dt: float) -> float:
    """Return what a hand wants after a time [s], no faster than a hand moves [m]."""
    limit = _FASTEST * dt
    return before + min(limit, max(-limit, wanted - before))


def doubt(hand: Learned) -> Learned:
    """Return what is known of a hand that has told something implausible."""
    return replace(hand, doubted=float(LAGS[-1]))


def lag_of(hand: Learned) -> float:
    """Return the lag with which others hear what a hand wants [s]."""
    return max(hand.lag, hand.doubted)
