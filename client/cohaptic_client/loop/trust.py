"""The energy that a contact returns to the hand, and how far models of others are trusted by it.

Models answer at once, and nothing behind them filters what they do. On an honest server a resting
hand receives through them what its own damping takes. Whoever lies, a server or a co-user, can make
them drive the hand. So the client accounts for the work that its contact does on the hand in the
band in which hands swing, whatever makes it:

    made' = force * velocity - ALLOWED,  both above the corner of the band,  0 <= made.

Where `made` exceeds `MAX_MADE`, the share of the models falls to zero, so that the room's lag
comes back, and the passivity layer may take out what was made beyond (science 3.15).
"""

from __future__ import annotations

from typing import Final, NamedTuple

# s; corner of the band at 1.6 Hz. What is slower is the work of people who press on purpose: the
# hand's own spring returns it.
_BAND: Final = 0.1
# W that a hand may receive in the band for ever. Hands of 1 N s/m beside others that tap by 8 mm
# receive less than 1 mW.
ALLOWED: Final = 0.002
# J beyond that. A tap of another lends a light hand up to 5 mJ for a quarter of its swing (science
# 3.15, Energy; test_trust.py).
MAX_MADE: Final = 0.008
# J; models come back within 11 s after whatever it was: 6 s for 12 mJ at 2 mW, 5 s for the rise.
_MAX_KEPT: Final = 2.0 * MAX_MADE
# 1/s; gone in 50 ms, half a swing at 10 Hz; the force then follows at the rate of the slew.
_FALL: Final = 20.0
# 1/s; so that whoever drives a hand again and again has it for a small part of the time. Reasoned,
# not measured.
_RISE: Final = 0.2
_PUNCTUAL: Final = 0.0025  # s; the longest period of a client, 2 ms at 500 Hz, and a quarter more


class Trust(NamedTuple):
    """The account, and the share of the models that follows from it.

    Fields:
        fraction: Share of the models that may be shown, 0 to 1.
        made: Energy in the account [J].
        force: Force on the hand, out of the object, above the corner of the band [N].
        place: Displacement of the hand, out of the object, above it [m].
        last: Force on the hand in the last period [N].
    """

    fraction: float = 1.0
    made: float = 0.0
    force: float = 0.0
    place: float = 0.0
    last: float = 0.0


FULL_TRUST: Final = Trust()


def trusted(trust: Trust, force: float, moved: float, dt: float) -> Trust:
    """Return the account after a period.

    Args:
        trust: Account before it.
        force: Force on the hand at its end, out of the object [N].
        moved: Displacement of the hand in it, out of the object [m].
        dt: Duration [s].
    """
    kept = _BAND / (_BAND + dt)
    fast_force, place = kept * (trust.force + force - trust.last), kept * (trust.place + moved)
    # The device holds the last force all the way. What that makes of a spring in a punctual period
    # is within the device's own damping (Colgate's bound), and no work of models.
    held = trust.force if dt > _PUNCTUAL else 0.5 * (trust.force + fast_force)
    work = held * (place - trust.place)
    # (3.15, Energy) a' = f~ x~' - p, a >= 0, with a = made and p = ALLOWED
    made = min(_MAX_KEPT, max(0.0, trust.made + work - ALLOWED * dt))
    fraction = trust.fraction
    if made > MAX_MADE:  # (3.15, Energy) a > E
        fraction = max(0.0, fraction - _FALL * dt)
    elif fraction < 1.0 and made <= 0.5 * MAX_MADE:
        fraction = min(1.0, fraction + _RISE * dt)
    return Trust(fraction, made, fast_force, place, force)


def beyond(trust: Trust) -> float:
    """Return the energy that the passivity layer may take out although models answer [J]."""
    return max(0.0, trust.made - MAX_MADE)
