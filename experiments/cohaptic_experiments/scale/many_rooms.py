"""10,000 rooms on 400 machines for a day: seats, silences, waits, and the load of the witnesses.

Costs are those of `benchmarks/cluster.py`; the load of a witness is counted, not
simulated. The day has twice as many people in the afternoon as on average.
"""

# pyright: reportUnknownMemberType=false

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from cohaptic_experiments.outcome import Options, Outcome, Progress, Table, at_least, at_most
from cohaptic_experiments.plot_style import GREY, PROBE, PROXY, THIRD, canvas
from cohaptic_experiments.scale.world import DAY, Costs, Plan, Record, World
from cohaptic_server.numeric import Floats

NAME = "scale"
TITLE = "10,000 rooms on 400 machines for a day: failures, updates, and what people notice"
ASKS = 6.0 / 2.5  # questions of a node to a witness in a second
# Processor time of a witness for a question, and for each room in it [s]: decoding, granting and
# encoding were measured; receiving and sending take as long as any message of asyncio.
QUESTION, EACH = 110e-6, 1.7e-6
QUICK = Plan(rooms=500, machines=20, people=400.0, between_failures=2.0 * DAY, joins=2)


def run(options: Options, progress: Progress) -> Outcome:
    """The day, and what it shows."""
    plan, costs = replace(QUICK if options.quick else Plan(), seed=options.seed), Costs()
    record = World(plan, costs).run(progress)
    samples = np.array(record.samples)
    failure = np.array(record.silences["failure"] or [np.nan])
    update = np.array(record.silences["update"] or [np.nan])
    waits = np.array(record.waits)
    lost = float(np.nansum(failure) + np.nansum(update))
    largest = samples[samples[:, 3].argmax()]
    load = witness_load(record, costs)
    per_core = float((samples[:, 1] / np.maximum(samples[:, 3], 1e-9))[samples[:, 1] > 0].mean())
    return Outcome(
        _figure(samples, failure, update, waits),
        Table(
            ("t_s", "people", "open_rooms", "cores_in_use", "machines"),
            [tuple(map(float, row)) for row in samples],
        ),
        {
            "people who came": record.joined,
            "people for whom there was no room": record.refused,
            "people at once, at most": float(samples[:, 1].max()),
            "open rooms at once, at most": float(samples[:, 2].max()),
            "processors in use at most, of all": (
                f"{largest[3]:.0f} of {largest[4] * plan.cores:.0f}"
            ),
            "people for each processor in use": per_core,
            "silences by failures": len(record.silences["failure"]),
            "silences by failures, median and 99 %, s": _two(failure),
            "silences by the update": len(record.silences["update"]),
            "silences by the update, median and 99 %, s": _two(update),
            "waits for a room that had ended": len(waits),
            "waits, median and 99 %, s": _two(waits),
            "processors of a witness": load,
            "bytes that witnesses read in a second": bytes_read(samples),
        },
        (
            at_most("99 % of the waits for a room that had ended, s", _high(waits, 99.0), 2.0),
            at_most("99 % of the silences by a failure, s", _high(failure, 99.0), 5.0),
            at_most("99 % of the silences by the update, s", _high(update, 99.0), 2.5),
            at_most("any wait or silence, s", float(np.nanmax([*failure, *update, *waits])), 8.0),
            at_most("touch that is lost, seconds an hour of touch", 3600.0 * lost / record.touched,
                    2.0),
            at_most("people without a room, share", record.refused / record.joined, 1e-3),
            at_least("silences that were measured", float(len(update) + len(failure)), 20),
            at_most("processors of a witness", load, 1.0),
        ),
    )  # fmt: skip


def witness_load(record: Record, costs: Costs) -> float:
    """Processors that a witness takes when most rooms are open, to answer and to look at places."""
    samples = np.array(record.samples)
    machines, rooms = samples[:, 4].max(), samples[:, 2].max()
    look_ups = 2.0 * record.asked / DAY  # in the afternoon
    answers = ASKS * (machines * QUESTION + rooms * EACH) + look_ups * QUESTION
    look = costs.look * rooms
    return float(answers + look / max(costs.looks, 3.0 * look))


def bytes_read(samples: Floats) -> float:
    """Bytes of questions to a witness in a second, when most rooms are open."""
    return float(ASKS * (samples[:, 4].max() * 154.0 + samples[:, 2].max() * 32.0))


def _high(times: Floats, percent: float) -> float:
    return float(np.nanpercentile(times, percent))


def _two(times: Floats) -> list[float]:
    return [round(_high(times, 50.0), 2), round(_high(times, 99.0), 2)]


def _figure(samples: Floats, failure: Floats, update: Floats, waits: Floats) -> Figure:
    figure = canvas(7.2, 5.0)
    day, silent = figure.subplots(2, 1)
    hours = samples[:, 0] / 3600.0
    day.plot(hours, samples[:, 1], color=PROBE, label="people")
    day.plot(hours, samples[:, 2], color=PROXY, label="open rooms")
    day.plot(hours, samples[:, 3], color=THIRD, label="processors in use")
    day.plot(hours, samples[:, 4], color=GREY, label="machines")
    day.set_yscale("log")
    day.set_ylim(bottom=1.0)
    day.set_xlim(0.0, 24.0)
    day.set_xticks(range(0, 25, 3))
    day.set_xlabel("hour of the day")
    day.set_title("one day")
    day.legend(ncols=4, loc="lower right")
    bins = np.linspace(0.0, 6.0, 61)
    for times, name, color in (
        (waits, "first touch of a room that had ended", THIRD),
        (update, "update of the machine", PROBE),
        (failure, "failure of the machine", PROXY),
    ):
        known = times[np.isfinite(times)]
        if known.size:
            fraction = np.full(known.size, 100.0 / known.size)
            silent.hist(known, bins, weights=fraction, histtype="step", color=color, label=name)
    silent.set_xlabel("time without touch [s]")
    silent.set_ylabel("share [%]")
    silent.set_title("times without touch, by cause")
    silent.legend()
    return figure
