"""Writes the known state of a server in the text format of Prometheus.

Labels are words of this program, names of rooms, which the owner chooses, and seat numbers. The
numbers of rooms and of seats thus bound the number of time series, whatever names the users have.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector

from cohaptic.status.quantiles import TIME_EDGES
from cohaptic_ops.monitoring.known import Known
from cohaptic_ops.monitoring.metrics import ClusterHealth, RoomMetrics, TimeCounts, UserMetrics

# Metrics of a room: name, help, and the function that reads the value.
_ROOM_GAUGES: tuple[tuple[str, str, Callable[[RoomMetrics], float]], ...] = (
    (
        "tick_period_seconds",
        "Time from one tick to the next, as it should be",
        lambda m: 1.0 / m.hz,
    ),
    ("users", "Users who touch", lambda m: len(m.users)),
    ("users_limit", "Users who may touch at once", lambda m: m.max_users),
    ("waiting", "People who wait for a seat", lambda m: m.waiting),
    ("watchers", "Watchers", lambda m: m.watchers),
    ("watchers_limit", "Watchers who may be there at once", lambda m: m.max_watchers),
    ("room_lag_seconds", "Lag with which the body gets forces", lambda m: m.lag),
    ("room_coupling", "Spectral radius of the coupling of the hands", lambda m: m.coupling),
    (
        "room_margin",
        "Margin of stability; above 1 hands at rest are stable, infinite without coupling",
        lambda m: math.inf if m.margin is None else m.margin,
    ),
    (
        "room_models_ratio",
        "Share of the models in what clients feel that move models of the hands",
        lambda m: math.nan if m.models is None else m.models,
    ),
    ("connections", "Connections that are open", lambda m: m.connections),
    ("process_resident_memory_bytes", "Memory of the process", lambda m: m.memory),
)
_ROOM_COUNTERS: tuple[tuple[str, str, Callable[[RoomMetrics], float]], ...] = (
    ("ticks", "Ticks that were due", lambda m: m.ticks),
    ("ticks_missed", "Ticks whose patches left after the next was due", lambda m: m.missed),
    ("ticks_left_out", "Missed ticks that were not simulated at all", lambda m: m.left_out),
    ("ticks_slept", "Ticks that nobody was there for and that changed nothing", lambda m: m.slept),
    ("process_cpu_seconds", "Time of processors that the process has taken", lambda m: m.processor),
)
_ROOM_LABELLED: tuple[tuple[str, str, str, Callable[[RoomMetrics], dict[str, int]]], ...] = (
    (
        "forces_limited",
        "Times a user's force was limited in a tick: depth is what the body bears there or all"
        " together, speed what others would feel change too fast",
        "reason",
        lambda m: m.limited,
    ),
    ("refused", "Sessions and requests refused by the server", "cause", lambda m: m.refused),
    (
        "budgets_spent",
        "Connections closed and responses refused for a spent budget",
        "budget",
        lambda m: m.spent,
    ),
    (
        "bytes",
        "Bytes of connections, without TLS and heads of responses",
        "direction",
        lambda m: {"received": m.received, "sent": m.sent},
    ),
)
_TIMES: tuple[tuple[str, str, Callable[[RoomMetrics], TimeCounts]], ...] = (
    ("tick_duration_seconds", "Time from a tick's start until its patches left", lambda m: m.cost),
    ("tick_lateness_seconds", "Delay of a tick's start", lambda m: m.lateness),
)
_USER_GAUGES: tuple[tuple[str, str, Callable[[UserMetrics], float | None]], ...] = (
    ("user_delay_seconds", "Delay of a user's loop", lambda u: u.delay),
    (
        "user_samples_unused_ratio",
        "Share of a user's samples that no tick has used",
        lambda u: u.loss,
    ),
    ("user_silence_seconds", "Time since a user's newest message", lambda u: u.silence),
    (
        "user_wavers_seconds",
        "Time by which a user's samples are used later, so that nobody feels the link's jitter",
        lambda u: u.wavers,
    ),
    ("user_force_newtons", "Force that the body gets of a user", lambda u: u.force),
)


_CLUSTER_GAUGES: tuple[tuple[str, str, Callable[[ClusterHealth], float]], ...] = (
    ("witnesses", "Witnesses, more than half of which have to answer", lambda c: c.witnesses),
    ("witnesses_answering", "Witnesses that have answered lately", lambda c: c.answering),
    ("rooms_owned", "Rooms that this machine owns", lambda c: c.owned),
    ("connections_passed", "Connections passed on to other machines", lambda c: c.passed),
    (
        "engine_reached",
        "Whether the engine was heard lately; no number where this machine does not ask it",
        lambda c: math.nan if c.engine is None else c.engine,
    ),
    (
        "decides",
        "Whether this machine tells the engine which rooms are wanted",
        lambda c: c.decides,
    ),
)


class _Server(Collector):
    """Collector for the Prometheus library: yields the metrics that are known at one time.

    Args:
        known: State of the server according to its reports so far.
        now: Time [s].
    """

    def __init__(self, known: Known, now: float) -> None:
        self._known, self._now = known, now

    def collect(self) -> Iterator[Metric]:
        """Yield one family of metrics after another, each with its values for all rooms."""
        yield from self._health()
        rooms = {
            name: known.metrics
            for name, known in self._known.rooms.items()
            if known.fresh(self._now)  # an old report must not look like a new one
        }
        for name, text, value in _ROOM_GAUGES:
            yield _gauge(name, text, rooms, value)
        for name, text, value in _ROOM_COUNTERS:
            counter = CounterMetricFamily(f"cohaptic_{name}", text, labels=["room"])
            for room, metrics in rooms.items():
                counter.add_metric([room], value(metrics))
            yield counter
        for name, text, label, counted in _ROOM_LABELLED:
            counter = CounterMetricFamily(f"cohaptic_{name}", text, labels=["room", label])
            for room, metrics in rooms.items():
                for key, count in sorted(counted(metrics).items()):
                    counter.add_metric([room, key], count)
            yield counter
        for name, text, measured in _TIMES:
            histogram = HistogramMetricFamily(f"cohaptic_{name}", text, labels=["room"])
            for room, metrics in rooms.items():
                counts = measured(metrics)
                histogram.add_metric([room], list(_buckets(counts)), counts.total)
            yield histogram
        yield from _of_users(rooms)

    def _health(self) -> Iterator[Metric]:
        known, now = self._known, self._now
        alive, ready = not known.why_not_alive(now), not known.why_not_ready(now)
        yield _plain("server_up", "Whether the server has reported within 3 s", alive)
        yield _plain("server_ready", "Whether people may be sent here", ready)
        health = known.health
        if health is None:
            return
        info = GaugeMetricFamily("cohaptic_build_info", "The program", labels=["version"])
        info.add_metric([health.version], 1.0)
        yield info
        yield _plain("server_draining", "Whether the server is about to end", health.draining)
        yield _plain("server_connections", "Connections open at the door", health.connections)
        refused = CounterMetricFamily(
            "cohaptic_server_refused_connections", "Connections that the door did not take"
        )
        refused.add_metric([], health.refused)
        yield refused
        if health.cluster is not None:
            for name, text, value in _CLUSTER_GAUGES:
                yield _plain(f"cluster_{name}", text, value(health.cluster))
        idle = known.why_not_ticking(now)
        ticking = GaugeMetricFamily(
            "cohaptic_room_ticking", "Whether a room ticks", labels=["room"]
        )
        restarts = CounterMetricFamily(
            "cohaptic_room_restarts", "Ends of a room's process so far", labels=["room"]
        )
        for room in health.rooms:
            ticking.add_metric([room.name], float(room.name not in idle))
            restarts.add_metric([room.name], room.restarts)
        yield ticking
        yield restarts


def exposition(known: Known, now: float) -> bytes:
    """Return the metrics of a server as text for Prometheus.

    Args:
        known: State of the server according to its reports so far.
        now: Time [s].
    """
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Server(known, now))
    return generate_latest(registry)


def _plain(name: str, text: str, value: float) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"cohaptic_{name}", text, value=float(value))


def _gauge(
    name: str, text: str, rooms: Mapping[str, RoomMetrics], value: Callable[[RoomMetrics], float]
) -> GaugeMetricFamily:
    gauge = GaugeMetricFamily(f"cohaptic_{name}", text, labels=["room"])
    for room, metrics in rooms.items():
        gauge.add_metric([room], value(metrics))
    return gauge


def _of_users(rooms: Mapping[str, RoomMetrics]) -> Iterator[Metric]:
    labels = ["room", "seat"]
    for name, text, value in _USER_GAUGES:
        gauge = GaugeMetricFamily(f"cohaptic_{name}", text, labels=labels)
        for room, user in _seated(rooms):
            if (measured := value(user)) is not None:
                gauge.add_metric([room, str(user.seat)], measured)
        yield gauge
    skipped = CounterMetricFamily(
        "cohaptic_user_patches_skipped", "Patches that a newer one has replaced", labels=labels
    )
    for room, user in _seated(rooms):
        skipped.add_metric([room, str(user.seat)], user.skipped)
    yield skipped


def _seated(rooms: Mapping[str, RoomMetrics]) -> Iterable[tuple[str, UserMetrics]]:
    return [(room, user) for room, metrics in rooms.items() for user in metrics.users]


def _buckets(counts: TimeCounts) -> Iterator[tuple[str, float]]:
    """Yield the upper edge of each bucket with the cumulative count, as the format requires."""
    below = 0
    for edge, count in zip((*TIME_EDGES, math.inf), counts.counts, strict=True):
        below += count
        yield ("+Inf" if edge == math.inf else f"{edge:.6g}"), below
