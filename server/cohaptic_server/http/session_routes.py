"""What a page asks about a recorded session by HTTP: paths, their queries, and the responses."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, cast
from urllib.parse import parse_qs

from cohaptic.recording.why import Why
from cohaptic_server.http.routes import Answer, Request, moved, page, text

# By this query the page knows that it stands before a session. One of its own may follow:
# `/?session&view=engineer`.
MARKED = "?session"
OVERVIEW, MESH, SCENES, WHY = "/session.json", "/session/mesh", "/session/scenes", "/session/why"
_MAX_QUERY = 200  # characters
_MAX_USER = 2**32 - 1


@dataclass(frozen=True, slots=True)
class ScenesAsked:
    """Question for the scenes from a time on until before another [s]."""

    start: float
    end: float


@dataclass(frozen=True, slots=True)
class WhyAsked:
    """Question why the force on a user's hand was as it was at a time [s]."""

    user: int
    t: float


def answer(
    request: Request, overview: Mapping[str, Any], mesh: bytes
) -> Answer | ScenesAsked | WhyAsked | None:
    """Return the response to a request, or the question for which the file has to be read.

    Args:
        overview: `Replay.overview`.
        mesh: Frame of the resting mesh.

    Returns:
        None for a request that is not about the session: for the page's own files.
    """
    path, _, query = request.target.partition("#")[0].partition("?")
    if path == "/" and not f"?{query}".startswith(MARKED):
        return moved(request, MARKED + (f"&{query}" if query else ""))
    if path not in (OVERVIEW, MESH, SCENES, WHY):
        return None
    if request.method not in ("GET", "HEAD"):
        message = f"{request.method[:16]} is not served here; GET and HEAD are\n"
        return text(request, 405, "Method Not Allowed", message, ("Allow", "GET, HEAD"))
    if path == OVERVIEW:
        return page(request, "application/json", json.dumps(overview).encode())
    if path == MESH:
        return page(request, "application/octet-stream", mesh)
    try:
        return _question(path, query)
    except ValueError as error:
        return bad(request, str(error))


def _question(path: str, query: str) -> ScenesAsked | WhyAsked:
    """Return the question of a query.

    Raises:
        ValueError: The query is too long, or a field is missing, there twice or no number.
    """
    if len(query) > _MAX_QUERY:
        raise ValueError(f"the query has {len(query)} characters; {_MAX_QUERY} are allowed")
    fields = parse_qs(query, max_num_fields=8)

    def number(name: str) -> float:
        values = fields.get(name, [])
        if len(values) != 1:
            raise ValueError(f"the query has {name} {len(values)} times; it must have it once")
        try:
            found = float(values[0])
        except ValueError:
            found = math.nan
        if not math.isfinite(found):
            raise ValueError(f"{name} is {values[0][:30]!r}; it must be a number")
        return found

    if path == SCENES:
        return ScenesAsked(number("from"), number("to"))
    user = number("user")
    if not (user.is_integer() and 0.0 <= user <= _MAX_USER):
        raise ValueError(f"user is {user:g}; it must be the number of a user")
    return WhyAsked(int(user), number("t"))


def bad(request: Request, why: str) -> Answer:
    """Make the response to a question that cannot be answered, with the reason."""
    return text(request, 400, "Bad Request", f"{why}\n")


def scenes_answer(request: Request, scenes: bytes) -> Answer:
    """Make the response with a stretch of scenes, `Replay.scenes`."""
    return page(request, "application/octet-stream", scenes)


def why_answer(request: Request, why: Why | None) -> Answer:
    """Make the response with a ledger as JSON: null for none; a number that is not finite, too."""
    said = None if why is None else _finite(asdict(why))
    return page(request, "application/json", json.dumps(said).encode())


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        fields = cast(dict[str, Any], value)
        return {key: _finite(each) for key, each in fields.items()}
    if isinstance(value, tuple | list):
        return [_finite(each) for each in cast(Sequence[Any], value)]
    return value
