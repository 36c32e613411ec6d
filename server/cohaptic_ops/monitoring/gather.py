"""Collects the metrics of a server between two ticks, once a second."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

from cohaptic.status.quantiles import Histogram
from cohaptic_ops.monitoring.metrics import RoomMetrics, TimeCounts, UserMetrics
from cohaptic_server.room.member import Member
from cohaptic_server.shell.server import CohapticServer

EVERY = 1.0  # s between two reports of a room
# Weight of the newest report in the smoothed fraction of unused samples: older values lose half of
# their weight within two reports.
_NEW_FRACTION = 0.3
_STATM = Path("/proc/self/statm")


@dataclass(slots=True)
class _Seat:
    """What the next report needs to know about a user from earlier reports.

    Args:
        number: Number of the seat, from 1.
        seen: Sequence number of the newest sample at the last report with new samples.
        used: Number of samples that ticks had used at that report.
        loss: Smoothed fraction of samples that no tick has used, at that report.
    """

    number: int
    seen: int
    used: int
    loss: float = 0.0


class Gatherer:
    """Collects the metrics of one server."""

    def __init__(self, server: CohapticServer) -> None:
        self._server = server
        self._seats: dict[int, _Seat] = {}

    def gather(self) -> RoomMetrics:
        """Return the metrics of the server at the present time."""
        server = self._server
        room, meters, limiter, traffic = (
            server.room, server.meters, server.limiter, server.limiter.traffic,
        )  # fmt: skip
        lag = room.world.room
        wishes = room.world.wishes
        return RoomMetrics(
            hz=server.settings.simulation_hz,
            ticks=meters.ticks,
            missed=meters.missed,
            left_out=meters.left_out,
            slept=meters.slept,
            cost=_counts(meters.costs),
            lateness=_counts(meters.delays),
            users=self._users(server.clock.now()),
            max_users=server.settings.max_users,
            waiting=len(room.queue),
            watchers=len(server.scene_broadcast.watchers),
            max_watchers=server.settings.max_watchers,
            lag=lag.lag,
            coupling=lag.coupling,
            margin=lag.margin if math.isfinite(lag.margin) else None,
            models=wishes.weight if wishes.hands else None,
            models_off=wishes.forbidden.by if wishes.weight < 1.0 else "",
            limited={"depth": meters.deep, "speed": meters.fast},
            refused=dict(traffic.refused) | {"connection": limiter.sources.refused},
            spent=dict(traffic.spent),
            connections=limiter.sources.open,
            received=traffic.received,
            sent=traffic.sent,
            processor=_processor_time(),
            memory=_resident_memory(),
        )

    def _users(self, now: float) -> tuple[UserMetrics, ...]:
        members = self._server.room.members
        self._seats = {user: self._seats[user] for user in self._seats if user in members}
        taken = {seat.number for seat in self._seats.values()}
        skipped = {
            peer.user: peer.session.outbox.patches_skipped
            for peer in self._server.session_host.peers
            if peer.user is not None
        }
        reported: list[UserMetrics] = []
        for user, member in members.items():
            if user not in self._seats:
                number = next(n for n in range(1, len(taken) + 2) if n not in taken)
                taken.add(number)
                self._seats[user] = _Seat(number, member.seen, member.used)
            reported.append(self._user(member, self._seats[user], skipped.get(user, 0), now))
        return tuple(sorted(reported, key=lambda user: user.seat))

    def _user(self, member: Member, seat: _Seat, skipped: int, now: float) -> UserMetrics:
        world = self._server.room.world
        users, cause, wishes = world.users, world.cause, world.wishes
        row = users.rows.get(member.user)
        delay = None if row is None else users.tracked.delays[row]
        sent, used = member.seen - seat.seen, member.used - seat.used
        if sent > 0:
            seat.loss += _NEW_FRACTION * (max(0.0, 1.0 - used / sent) - seat.loss)
            seat.seen, seat.used = member.seen, member.used
        return UserMetrics(
            seat=seat.number,
            name=member.hello.name,
            delay=delay.value if delay is not None and delay.recent >= 0.0 else None,
            loss=min(1.0, seat.loss),
            silence=max(0.0, now - member.heard),
            force=0.0 if row is None else float(users.applied.force[row]),
            skipped=skipped,
            capabilities=member.hello.capabilities,
            sets_lag=cause.by if member.user in cause.users else None,
            forbids_models=wishes.weight < 1.0 and member.user in wishes.forbidden.users,
            wavers=member.samples.playout.wavers,
        )


def _counts(histogram: Histogram) -> TimeCounts:
    return TimeCounts(counts=list(histogram.counts), total=histogram.total)


def _processor_time() -> float:
    times = os.times()
    return times.user + times.system


def _resident_memory() -> int:
    """Return the resident memory of this process [bytes]; 0 if the system does not report it."""
    try:
        return int(_STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return 0
