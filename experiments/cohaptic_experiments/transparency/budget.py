"""The parts of the delay with which half of a press is felt, each found by taking it out.

The parts are taken out one after the other, and each is the time that this saves. The two ways
through the network and the time that hand and body need without a network are known; the part that
is left comes from the further rounds that the forces take between the hands, and from the sampling
that remains at the fastest ticks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cohaptic_experiments.transparency.press import Press, felt_presses, true_presses
from cohaptic_experiments.transparency.product import Variant
from cohaptic_experiments.transparency.setting import Setting
from cohaptic_tools.demo.lateness import LEVELS

# m; a press that changes no force by more than the limits of rates allow
SMALL = 0.0005
FASTEST = 200.0  # Hz, the fastest ticks that a server has


@dataclass(frozen=True, slots=True)
class Budget:
    """Parts of the time from a press until the second hand has felt half of it [s].

    Args:
        ways: From the first hand to the server, and from there to the second one.
        hand_and_body: Time without a network.
        force_limit: Saved by a press so small that no limit of a rate acts.
        layer: Then saved without the damping of the passivity layer, at the same lag.
        lag: Then saved without the room's lag.
        ticks: Then saved by ticks at `FASTEST`.
        rest: Time that is left: further rounds between the hands.
        whole: Sum of all parts.
    """

    ways: float
    hand_and_body: float
    force_limit: float
    layer: float
    lag: float
    ticks: float
    rest: float
    whole: float


def measure_budget(setting: Setting, variant: Variant, shipped: Press) -> Budget:
    """Measure the parts of a delay.

    Args:
        setting: Hands, body and link.
        variant: How the program runs.
        shipped: Press as the second hand feels it with all parts (`felt_presses`).
    """
    half, lag = half_of([shipped]), _lag(setting, variant)
    small = _half(setting, variant)
    unlayered = _half(setting, replace(variant, layer=False, lag=lag))
    bare = replace(variant, layer=False, lag=0.0)
    unlagged, quick = _half(setting, bare), _half(setting, replace(bare, hz=FASTEST))
    ways, true = 2.0 * setting.link.delay, half_of(true_presses(setting, SMALL))
    return Budget(
        ways, true, half - small, small - unlayered, unlayered - unlagged,
        unlagged - quick, quick - ways - true, half,
    )  # fmt: skip


def _half(setting: Setting, variant: Variant) -> float:
    """Return the time at which the second hand has felt half of a small press [s]."""
    return half_of(felt_presses(setting, lambda: setting.product(variant), SMALL))


def half_of(presses: Sequence[Press]) -> float:
    """Return the time at which the second hand has felt half of a press [s]."""
    return float(presses[0].passed[LEVELS.searchsorted(0.5)])


def _lag(setting: Setting, variant: Variant) -> float:
    """Return the lag of the room at rest [s]."""
    product = setting.product(variant)
    setting.play(product, setting.intentions(), setting.rests_at)
    return product.lag
