"""The laws that a client may run, by their names and their numbers on the wire.

Each law is a class in a file of `laws/`, which says what it does and when it is stable.
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from cohaptic.control.geometry import Sight
from cohaptic.control.laws.model import LocalModel, dented_depth
from cohaptic.control.laws.pi import ProportionalIntegral
from cohaptic.control.laws.predictive import Predictive
from cohaptic.control.laws.proportional import Proportional


class Law(Enum):
    """A local model; the order of the members is that of their numbers on the wire.

    Code that treats laws differently tests an attribute of the model, not a law's name.

    Attributes:
        model: The law itself.
        answers_own_dent: As in the model.
    """

    PROPORTIONAL = "proportional"
    PI = "pi"
    PREDICTIVE = "predictive"

    model: LocalModel
    answers_own_dent: bool


_MODELS: Final[dict[str, LocalModel]] = {
    "proportional": Proportional(),
    "pi": ProportionalIntegral(),
    "predictive": Predictive(),
}
# Attributes are quicker than methods, and they are read every period and for every user every tick.
for _law in Law:
    _law.model = _MODELS[_law.value]
    _law.answers_own_dent = _law.model.answers_own_dent

DEFAULT_LAW: Final = Law.PREDICTIVE


def pressed_depth(law: Law, sight: Sight) -> float:
    """Return the depth of the probe below the surface on which a law presses [m].

    The predictive law presses on the free surface, and the paper's laws on the surface as the
    simulation returned it, which includes the own dent.
    """
    return dented_depth(sight) if law.answers_own_dent else sight.depth
