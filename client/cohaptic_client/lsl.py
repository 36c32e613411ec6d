"""Markers of the Lab Streaming Layer, on the clock of this machine; needs the extra `lsl`."""

from __future__ import annotations

import asyncio
import importlib
from collections.abc import AsyncGenerator
from typing import Any

from cohaptic.errors import SettingError
from cohaptic.protocol.messages import MAX_MARK_AGE, Mark
from cohaptic_client.network.marks import mark_of

_FIND = 10.0  # s to find a stream on the network
_LOOK = 0.2  # s in which a read ends, so that Ctrl-C does
_LONGEST = 200  # characters of a mark


def _pylsl() -> Any:
    try:
        return importlib.import_module("pylsl")
    except (ImportError, RuntimeError) as error:  # RuntimeError: without its library
        need = "given with the extra lsl: pip install 'cohaptic[lsl]'"
        raise SettingError("--lsl", "given", f"{need} ({error})") from error


async def markers(name: str) -> AsyncGenerator[Mark]:
    """Yield the markers of a stream; each says how long ago it was set.

    Args:
        name: Name of the stream; empty for the first stream of markers.

    Raises:
        SettingError: There is no such stream on the network, or the library is missing.
    """
    lsl = _pylsl()
    key, value = ("name", name) if name else ("type", "Markers")
    found = await asyncio.to_thread(lambda: lsl.resolve_byprop(key, value, 1, _FIND))
    if not found:
        limit = f"one that is there within {_FIND:g} s"
        raise SettingError("stream of Lab Streaming Layer", name or "of any name", limit)
    inlet = lsl.StreamInlet(found[0], max_buflen=60)
    await asyncio.to_thread(inlet.time_correction, _FIND)
    while True:
        values, at = await asyncio.to_thread(inlet.pull_sample, _LOOK)
        if not values:
            continue
        # Anew for each marker, since clocks drift; the library keeps it, and this does not wait.
        correction = inlet.time_correction(_FIND)
        ago = min(MAX_MARK_AGE, max(0.0, lsl.local_clock() - (at + correction)))
        text = " ".join(str(value) for value in values)[:_LONGEST] or "marker"
        yield mark_of(text, {"stream": found[0].name()[:_LONGEST]}, ago)
