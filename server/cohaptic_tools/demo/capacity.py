"""Predicts how many hands a machine bears, and at which rate, before any process is started.

The processes of a demonstration take nearly the same time of every processor for the same work, so
their cost is stated in units of a small computation, which is timed on the machine itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from cohaptic.clock import SystemClock, thread_time
from cohaptic.compiled import why_plain
from cohaptic.errors import SettingError
from cohaptic_server.side_by_side import processors
from cohaptic_tools.demo.scene import MAX_USERS, MIN_USERS

RATES = (60.0, 30.0)  # Hz of the simulation, the better first
_LOOP_HZ = 1000.0  # Hz of every haptic loop
# Fraction of the processors that a demonstration may take, so that its ticks come on time. On one
# core 0.55 of it kept up and 0.7 missed ticks; of two cores beside a browser 0.7 was too much.
_ON_TIME = 0.6
_REPEATS = 40  # of the computation, in 0.1 s: what else runs here shows in its share of the time


@dataclass(frozen=True, slots=True)
class Costs:
    """Time that the parts of a demonstration take, in units of `speed`.

    Measured with 2, 4 and 6 hands on the balloon, at 30, 60 and 120 Hz, from the processes' times.

    Args:
        tick: One tick of the server, beside what its users take.
        user: One user's part of a tick.
        period: One period of a haptic loop.
        exchange: One sample and one patch in a client's network process.
    """

    tick: float
    user: float
    period: float
    exchange: float

    def cores(self, users: int, hz: float) -> float:
        """Return the processor cores that a demonstration takes, in units of `speed` per second.

        Args:
            users: Number of hands.
            hz: Ticks per second.
        """
        server = hz * (self.tick + self.user * users)
        return server + users * (_LOOP_HZ * self.period + hz * self.exchange)


COMPILED = Costs(tick=0.67, user=0.18, period=0.027, exchange=0.3)
PLAIN = Costs(tick=1.33, user=0.7, period=0.077, exchange=0.3)


@dataclass(frozen=True, slots=True)
class Machine:
    """What a machine has for a demonstration.

    Args:
        unit: Time of the computation of `measure` [s].
        cores: Processor cores of the machine, or of the container.
        free: Fraction of them that a new process gets beside what runs there now.
        why_plain: Why modules run as plain Python; empty if they are compiled.
    """

    unit: float
    cores: float
    free: float
    why_plain: str

    def load(self, users: int, hz: float) -> float:
        """Return the processor time that a demonstration takes, as a fraction of the free one.

        Args:
            users: Number of hands.
            hz: Ticks per second.
        """
        costs = PLAIN if self.why_plain else COMPILED
        return self.unit * costs.cores(users, hz) / (self.cores * self.free)

    def bears(self, hz: float, fraction: float = _ON_TIME) -> int:
        """Return the largest number of hands whose forces come on time; 0 if not even two do.

        Args:
            hz: Ticks per second.
            fraction: Share of the free processor time that they may take.
        """
        fitting = (n for n in range(MAX_USERS, MIN_USERS - 1, -1) if self.load(n, hz) <= fraction)
        return next(fitting, 0)


def rate_for(machine: Machine, users: int, hz: float | None) -> tuple[float, str]:
    """Return the simulation rate for a number of hands [Hz], and a sentence where one is due.

    Args:
        machine: The machine.
        users: Number of hands.
        hz: Rate that the user wishes; None for the best of `RATES` that the machine keeps up with.

    Raises:
        SettingError: The hands would take more than the whole machine, even if it were idle.
    """
    rates = RATES if hz is None else (hz,)
    fitting = [rate for rate in rates if machine.load(users, rate) <= _ON_TIME]
    rate = fitting[0] if fitting else rates[-1]
    bears = machine.bears(rate)
    few = f"{bears} at {rate:g} Hz" if bears else f"fewer than {MIN_USERS} at {rate:g} Hz"
    idle = replace(machine, free=1.0)
    largest = max(MIN_USERS, idle.bears(rate, fraction=1.0))
    if users > largest:
        on_time = f"{idle.bears(rate)} of them on time"
        raise SettingError(
            "number of users", users, f"at most {largest} at {rate:g} Hz on this machine, {on_time}"
        )
    words: list[str] = []
    if machine.why_plain:
        words.append(f"plain Python, which takes twice the processor: {machine.why_plain}")
    if not fitting:
        words.append(f"this machine bears {few}: patches may come late")
    elif rate != rates[0]:
        words.append(f"{rate:g} Hz in place of {rates[0]:g}, which this machine keeps up with")
    return rate, "; ".join(words)


def measure() -> Machine:
    """Time a small computation on this machine, for 0.1 s."""
    clock, cores = SystemClock(), processors()
    begin, begun = clock.now(), thread_time()
    took: list[float] = []
    for _ in range(_REPEATS):
        before = thread_time()
        _compute()
        took.append(thread_time() - before)
    free = (thread_time() - begun) / (clock.now() - begin)
    why = why_plain("kernels") or why_plain("loop")
    # What is slow for a moment, as a clock that still rises, is not the machine's own. A part of a
    # core is all free where the computation gets as much.
    unit = sorted(took)[_REPEATS // 4]
    return Machine(unit, cores, min(1.0, free / min(1.0, cores)), why)


def _compute() -> float:
    """Do arithmetic on small tuples, as a haptic period and the Python of a tick do."""
    a, total = (0.1, 0.2, 0.3), 0.0
    for _ in range(20_000):
        a = (0.5 * a[1] + a[2], 0.25 * a[0] + a[2], 0.125 * a[0] + 1e-3)
        total += a[0] * a[1] - a[2]
    return total
