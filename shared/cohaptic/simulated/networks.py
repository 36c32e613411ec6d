"""Networks that people have, as settings of a simulated link, and the words for any other.

`wifi-busy` is one of them; `delay=80,jitter=40,loss=1` is a link of one's own, and
`wifi-busy,delay=30` one of them with another delay. A link has the same settings in both
directions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

from cohaptic.errors import SettingError
from cohaptic.simulated.delay_line import AT_ONCE, LARGEST, LinkSettings


@dataclass(frozen=True, slots=True)
class Network:
    """A kind of network.

    Args:
        link: Its link, one way.
        source: Where its figures are from.
    """

    link: LinkSettings
    source: str


NETWORKS: Final = {
    "lan": Network(
        LinkSettings(0.0002, 0.0002, tail=0.0001),
        "the order of what `ping` shows on gigabit Ethernet",
    ),
    "wifi": Network(
        LinkSettings(0.0005, 0.001, tail=0.001, memory=0.03, stall=0.1, stalls=1 / 60),
        "Sui et al., MobiSys 2016: median 3 ms, 90 % below 20 ms",
    ),
    "wifi-busy": Network(
        LinkSettings(0.002, 0.004, tail=0.012, memory=0.1, loss=0.002, stall=0.25, stalls=4 / 60),
        "between Sui et al., MobiSys 2016: 90 % below 20 ms both ways, 99 % below 250 ms, and"
        " Pei et al., INFOCOM 2016: half above 20 ms, one in ten above 100 ms",
    ),
    "4g": Network(
        LinkSettings(0.02, 0.016, tail=0.004, memory=0.05, stall=0.1, stalls=2 / 60),
        "Rohde & Schwarz, Munich, 2021 and 2022; a handover takes 50 ms and more",
    ),
    "5g": Network(
        LinkSettings(0.008, 0.008, tail=0.002, memory=0.05, stall=0.1, stalls=2 / 60),
        "Rohde & Schwarz, Munich, 2022: 7 ms down to 18 ms up, one way",
    ),
    "satellite": Network(
        LinkSettings(0.009, 0.004, tail=0.0015, memory=0.1, loss=0.001, stall=0.14, stalls=8 / 60),
        "Starlink, June 2025: median 25.7 ms both ways, 99 % below 55 ms; arXiv 2601.08439: spikes"
        " of 140 and 75 ms in each 15 s",
    ),
    "transatlantic": Network(
        LinkSettings(0.04, 0.002, tail=0.001, loss=0.001),
        "Martinez et al., arXiv 2301.07788: round trips of 70 to 90 ms",
    ),
}
# Words of a link, with the settings that they name, and how many of their units are one of SI's.
_WORDS: Final = {
    "delay": (1e-3, "ms"),
    "jitter": (1e-3, "ms"),
    "tail": (1e-3, "ms"),
    "memory": (1e-3, "ms"),
    "loss": (1e-2, "%"),
    "stall": (1e-3, "ms"),
    "stalls": (1.0 / 60.0, "/min"),
}


def read_network(text: str) -> LinkSettings:
    """Read the words for a link: a name, settings, or a name and settings that replace its own.

    Args:
        text: As `wifi`, `delay=80,jitter=40` or `wifi,delay=30`: delay, jitter, tail, memory and
            stall in ms, loss in %, stalls in one minute. Empty for a link that takes no time.

    Raises:
        SettingError: A word is unknown, or a value is not a number or out of its limits.
    """
    link, values = AT_ONCE, dict[str, Any]()
    for word in filter(None, (part.strip() for part in text.lower().split(","))):
        name, equals, value = (part.strip() for part in word.partition("="))
        if not equals and name in NETWORKS:
            if link is not AT_ONCE:
                raise SettingError("network", repr(text[:40]), "one name at most")
            link = NETWORKS[name].link
        elif equals and name in _WORDS:
            values[name] = _read(name, value)
        else:
            raise SettingError(
                "network",
                repr(word[:40]),
                f"one of: {', '.join(NETWORKS)}; or NAME=VALUE of: {', '.join(_WORDS)}",
            )
    link = replace(link, **values)
    if bool(link.stall) != bool(link.stalls):
        given = "stall" if link.stall else "stalls"
        other = "stalls=6" if link.stall else "stall=300"
        raise SettingError("network", repr(text[:40]), f"given with {other}, as it has a {given}")
    return link


def _read(name: str, text: str) -> float:
    scale, unit = _WORDS[name]
    largest = LARGEST[name] / scale
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= largest:
        limit = f"a number from 0 to {largest:g} {unit}"
        raise SettingError(f"{name} of a network", repr(text[:40]), limit)
    return scale * value


def in_words(link: LinkSettings) -> str:
    """Return a link as a person reads it: "80 ms each way", or with its words."""
    ms = f"{1e3 * link.delay:g} ms"
    only = link == LinkSettings(link.delay, seed=link.seed)
    return f"{ms} each way" if only else f"each way {words_for(link)}"


def words_for(link: LinkSettings) -> str:
    """Return the words for a link, from which `read_network` reads the same link; not its seed."""
    settings = {name: getattr(link, name) / scale for name, (scale, _) in _WORDS.items()}
    return ",".join(f"{name}={value:.9g}" for name, value in settings.items() if value)
