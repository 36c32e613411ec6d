"""How much memory a page's JavaScript holds, its Workers' as well, and how long its tasks take."""

from __future__ import annotations

import itertools
import json
from collections import defaultdict
from typing import Any, NamedTuple

from playwright.sync_api import Page

_PATIENCE = 600  # looks, of 50 ms each
# What the browser notes of slow tasks, fetches and events for whoever may ask, 150 to 250 of each
# kind: what begins so, on a machine that is slow.
_NOTES = ("Performance", "TaskAttribution", "blink::ScriptTiming", "blink::AnimationFrameTiming")
_ARRAYS = "system / JSArrayBufferData"  # what is behind typed arrays, as a snapshot names it
# Attribution of long tasks says no more than the window; the trace of a benchmark does.
WATCH_TASKS = """
window.longTasks = { count: 0, kept: new Float64Array(8192) }; // no objects, which are counted too
new PerformanceObserver((list) => {
  for (const { startTime, duration } of list.getEntries()) {
    longTasks.kept.set([startTime, duration], (2 * longTasks.count++) % longTasks.kept.length);
  }
}).observe({ type: "longtask", buffered: true });
"""


def long_tasks(page: Page, since: float) -> list[float]:
    """Durations of the tasks over 50 ms that began after a time of the page [ms].

    The page has to have been opened with `WATCH_TASKS` as an initial script.
    """
    kept: list[float] = page.evaluate("[...longTasks.kept]")
    pairs = zip(kept[::2], kept[1::2], strict=True)
    return [duration for start, duration in pairs if duration > 0.0 and start >= since]


class Held(NamedTuple):
    """Memory of a page or of a Worker.

    Args:
        objects: What JavaScript holds, and what the browser holds for it [bytes].
        code: Functions as the engine has compiled them: it does so again as they run [bytes].
        arrays: What is behind typed arrays [bytes].
        notes: What the browser notes of how fast the page is, in buffers with bounds [bytes].
    """

    objects: int
    code: int
    arrays: int
    notes: int


class Heaps:
    """The heaps of a page and of its Workers, over the protocol of the browser's own tools."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._cdp: Any = page.context.new_cdp_session(page)
        self._workers: dict[str, str] = {}
        self._answers: dict[int, Any] = {}
        self._numbers = itertools.count(1)
        self._chunks: dict[str, list[str]] = defaultdict(list)
        self._cdp.on("HeapProfiler.addHeapSnapshotChunk", self._heard_of_page)
        self._cdp.on("Target.attachedToTarget", self._attached)
        self._cdp.on("Target.detachedFromTarget", self._detached)
        self._cdp.on("Target.receivedMessageFromTarget", self._heard)
        # The protocol of a Worker goes through its page's, since playwright has none for it.
        self._cdp.send(
            "Target.setAutoAttach",
            {"autoAttach": True, "waitForDebuggerOnStart": False, "flatten": False},
        )

    def held(self) -> dict[str, Held]:
        """What is held after everything that can go has gone: `page`, and each Worker."""
        for _ in range(2):  # what waited for the first collection goes with the second
            self._cdp.send("HeapProfiler.collectGarbage")
        self._cdp.send("HeapProfiler.takeHeapSnapshot")
        found = {"page": self._counted("")}
        for session, name in list(self._workers.items()):
            for _ in range(2):
                self._ask(session, "HeapProfiler.collectGarbage")
            self._ask(session, "HeapProfiler.takeHeapSnapshot")
            found[name] = self._counted(session)
        return found

    def _counted(self, session: str) -> Held:
        return counted(json.loads("".join(self._chunks.pop(session))))

    def _heard_of_page(self, event: Any) -> None:
        self._keep("", event)

    def _keep(self, session: str, event: Any) -> None:
        self._chunks[session].append(event["chunk"])

    def _attached(self, event: Any) -> None:
        if event["targetInfo"]["type"] == "worker":
            self._workers[event["sessionId"]] = event["targetInfo"]["title"] or "worker"

    def _detached(self, event: Any) -> None:
        self._workers.pop(event["sessionId"], None)

    def _heard(self, event: Any) -> None:
        message = json.loads(event["message"])
        if "id" in message:
            self._answers[message["id"]] = message.get("result", {})
        elif message["method"] == "HeapProfiler.addHeapSnapshotChunk":
            self._keep(event["sessionId"], message["params"])

    def _ask(self, session: str, method: str) -> Any:
        number = next(self._numbers)
        message = json.dumps({"id": number, "method": method})
        self._cdp.send("Target.sendMessageToTarget", {"sessionId": session, "message": message})
        for _ in range(_PATIENCE):
            if number in self._answers:
                return self._answers.pop(number)
            self._page.wait_for_timeout(50)
        raise TimeoutError(f"a Worker did not answer {method}")


def counted(snapshot: Any) -> Held:
    """The sizes of a heap snapshot of V8, by what they are of."""
    meta = snapshot["snapshot"]["meta"]
    fields, types = meta["node_fields"], meta["node_types"][0]
    kinds, names, sizes = (
        snapshot["nodes"][fields.index(field) :: len(fields)]
        for field in ("type", "name", "self_size")
    )
    code, strings = types.index("code"), snapshot["strings"]
    native = types.index("native")
    named = {i: "arrays" for i, string in enumerate(strings) if string == _ARRAYS}
    named |= {i: "notes" for i, string in enumerate(strings) if string.startswith(_NOTES)}
    found = {"objects": 0, "code": 0, "arrays": 0, "notes": 0}
    for kind, name, size in zip(kinds, names, sizes, strict=True):
        what = (
            "code" if kind == code else named.get(name, "objects") if kind == native else "objects"
        )
        found[what] += size
    return Held(**found)
