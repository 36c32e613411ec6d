"""From a request at the admin port to its response. No I/O."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from urllib.parse import parse_qs

from prometheus_client.exposition import CONTENT_TYPE_LATEST

from cohaptic_server.http.routes import Answer, Request, page, text
from cohaptic_server.monitoring.exposition import exposition
from cohaptic_server.monitoring.known import NO_ROOM, Known

_JSON = "application/json"
INDEX = (
    "The admin port of a cohaptic server.\n\n"
    "/metrics  for Prometheus\n"
    "/healthz  whether the server is alive\n"
    "/readyz   whether people may be sent here; ?room=NAME for one room\n"
    "/status   everything as JSON; cohaptic top shows it\n"
)


def answer(request: Request, known: Known, now: float) -> Answer:
    """The response.

    Args:
        request: From whoever reaches the port.
        known: Of the server.
        now: Time [s].
    """
    if request.method not in ("GET", "HEAD"):
        message = f"{request.method[:16]} is not served here; GET and HEAD are\n"
        return text(request, 405, "Method Not Allowed", message, ("Allow", "GET, HEAD"))
    path, _, query = request.target.partition("#")[0].partition("?")
    if path == "/":
        return text(request, 200, "OK", INDEX)
    if path == "/metrics":
        return page(request, CONTENT_TYPE_LATEST, exposition(known, now))
    if path == "/healthz":
        return _verdict(request, known.why_not_alive(now))
    if path == "/readyz":
        asked = parse_qs(query, keep_blank_values=True, max_num_fields=None).get("room")
        why = known.why_not_ready(now, asked[0] if asked else None)
        found = _verdict(request, why, known.why_not_ticking(now))
        return replace(found, status=404, phrase="Not Found") if why == [NO_ROOM] else found
    if path == "/status":
        return page(request, _JSON, _encode(status(known, now)))
    return text(request, 404, "Not Found", "there is nothing of this name here\n")


def status(known: Known, now: float) -> dict[str, Any]:
    """All that is known, for programs."""
    health, idle = known.health, known.why_not_ticking(now)
    rooms: list[dict[str, Any]] = []
    for room in () if health is None else health.rooms:
        reported = known.rooms.get(room.name)
        rooms.append(
            room.model_dump()
            | {
                "ticking": room.name not in idle,
                "age": None if reported is None else round(now - reported.heard, 3),
                "metrics": None if reported is None else reported.metrics.model_dump(),
            }
        )
    return {
        "version": "" if health is None else health.version,
        "alive": not known.why_not_alive(now),
        "ready": not known.why_not_ready(now),
        "draining": health is not None and health.draining,
        "reasons": known.why_not_ready(now),
        "connections": 0 if health is None else health.connections,
        "refused": 0 if health is None else health.refused,
        "rooms": rooms,
    }


def _verdict(request: Request, why: Sequence[str], idle: dict[str, str] | None = None) -> Answer:
    told: dict[str, Any] = {"ok": not why, "reasons": list(why)}
    if idle is not None:
        told["not_ticking"] = idle
    answered = page(request, _JSON, _encode(told))
    return answered if not why else replace(answered, status=503, phrase="Service Unavailable")


def _encode(told: dict[str, Any]) -> bytes:
    return json.dumps(told, indent=1).encode() + b"\n"
