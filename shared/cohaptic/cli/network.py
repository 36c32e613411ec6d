"""The options of a simulated network: the same words for every command that has one."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from cohaptic.simulated.delay_line import LinkSettings
from cohaptic.simulated.networks import NETWORKS, read_network

Network = Annotated[
    str,
    typer.Option(
        metavar="WORDS",
        help=f"Injected network: {', '.join(NETWORKS)}; or as delay=80,jitter=40,loss=1.",
    ),
]
DelayMs = Annotated[
    float | None, typer.Option(help="Injected delay, each way [ms].", show_default=False)
]
JitterMs = Annotated[
    float | None, typer.Option(help="Largest further delay, each way [ms].", show_default=False)
]


def injected(network: str, delay_ms: float | None, jitter_ms: float | None) -> LinkSettings:
    """Return the link that the options of a command describe.

    Args:
        network: Words for a link.
        delay_ms, jitter_ms: Delay and jitter in place of the network's [ms]; None for its own.

    Raises:
        SettingError: A word is unknown, or a value is out of its limits.
    """
    link = read_network(network)
    delay = link.delay if delay_ms is None else 1e-3 * delay_ms
    jitter = link.jitter if jitter_ms is None else 1e-3 * jitter_ms
    return replace(link, delay=delay, jitter=jitter)
