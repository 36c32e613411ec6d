"""Shows the result of a demonstration as a table on the terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable

from rich.console import Group
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from cohaptic.control.friction import MAX_FRICTION
from cohaptic.simulated.networks import in_words, read_network
from cohaptic.status.table import LEAST_LAG, lag_words, soft_words
from cohaptic_tools.demo.felt import FELT
from cohaptic_tools.demo.punctuality import Blame
from cohaptic_tools.demo.rest import Rest
from cohaptic_tools.demo.result import GOOD_ERROR, DemoResult, UserResult

_PUNCTUAL = 0.8  # fraction of patches received; below it the machine is too slow for a verdict


def show(result: DemoResult) -> Panel:
    """Return a panel with a verdict, a table of the users, and remarks."""
    felt = "drag felt" if result.friction else "felt of the others"
    table = Table(box=None, pad_edge=False)
    for name in ("user", felt, "truth", "off by", "half after", "90 % after", "stable", "loop"):
        table.add_column(name, justify="left" if name == "user" else "right")
    for user in result.users:
        error = user.force_error
        good = error is not None and error <= GOOD_ERROR
        table.add_row(
            user.name,
            _number(user.felt_from_others_n, "+.2f", " N"),
            _number(user.truth_from_others_n, "+.2f", " N"),
            Text(_number(error, ".1%"), style="green" if good else "yellow"),
            # The first hand makes the change and has no delay.
            "" if user is result.users[0] else _number(user.felt_delay_ms, ".0f", " ms"),
            "" if user is result.users[0] else _number(user.felt_most_ms, ".0f", " ms"),
            _REST[user.rest],
            f"{user.loop_hz:.0f} Hz",
        )
    return Panel(
        Group(Text(verdict(result), style="bold"), "", table, *_notes(result)),
        title="what they felt of each other",
        title_align="left",
        expand=False,
    )


_REST = {
    Rest.RESTS: Text("yes", "green"),
    Rest.SLOW: Text("slow", "yellow"),
    Rest.UNSTABLE: Text("NO", "bold red"),
    None: Text("?"),
}


def _notes(result: DemoResult) -> list[Text]:
    """Return remarks on soft devices, lag, slipping fingers and faults."""
    notes = [f"{user.name}: device renders {soft(user)}" for user in result.users if user.soft]
    if result.late is Blame.MACHINE:
        notes.append(f"this machine is busy: {_lateness(result)}")
    if result.lag_ms >= 1e3 * LEAST_LAG:
        notes.append(lag_words(1e-3 * result.lag_ms))
    notes += [
        f"{user.name}'s finger slips at a friction of {result.friction:g}: {_to_stick(user)}"
        for user in slipping(result)
    ]
    notes += [
        f"force was off for a while: {user.name}: {fault}"
        for user in result.users
        for fault in user.faults
    ]
    return [Text(note, style="yellow") for note in notes]


def soft(user: UserResult) -> str:
    """Return a comparison of a device's stiffness with that of the object, in words."""
    return soft_words(user.max_stiffness, user.k_o)


def _to_stick(user: UserResult) -> str:
    """Return in words the friction that a slipping finger would need to stick."""
    needed = user.friction_needed or 0.0
    return f"to stick it needs {needed:.2f}" if needed <= MAX_FRICTION else "no finger could stick"


def slipping(result: DemoResult) -> list[UserResult]:
    """Return the users whose finger slips, in a scene with friction; empty without friction."""
    return [u for u in result.users if (u.friction_needed or 0.0) > result.friction]


def verdict(result: DemoResult) -> str:
    """Return a summary of the demonstration in a sentence or two."""
    how = f"{result.law} law, {in_words(read_network(result.network))}, {result.simulation_hz:g} Hz"
    swinging = _names(u for u in result.users if u.rest is Rest.UNSTABLE)
    if swinging:
        return f"Unstable: the force of {swinging} swings and does not come to rest ({how})."
    rates = [user.patch_hz for user in result.users if user.patch_hz is not None]
    rate = min(rates, default=result.simulation_hz)
    if rate < _PUNCTUAL * result.simulation_hz and result.late is not Blame.LINK:
        return (
            f"This machine cannot keep up with {len(result.users)} users: patches came at"
            f" {rate:.0f} of {result.simulation_hz:g} Hz.\nTake fewer users or a lower"
            f" --simulation-hz ({how})."
        )
    unknown = _names(u for u in result.users if u.rest is None)
    if result.presses == 0 and not any(user.faults for user in result.users):
        return _too_short(result, how)
    if unknown and result.late is Blame.LINK:
        return (
            f"The link kept the force of {unknown} moving: {_lateness(result)}, by a network that"
            f" wavers ({how}).\nA law is judged on a steadier one (--network, --jitter-ms)."
        )
    if unknown and result.late is Blame.MACHINE:
        return (
            f"This machine was too busy to judge the force of {unknown}: {_lateness(result)}"
            f" ({how}).\nEnd what else runs here, or take fewer users or a lower --simulation-hz."
        )
    if result.presses == 0 or unknown:
        return _too_short(result, how)
    left, right = result.users[:2]
    felt = _number(right.felt_from_others_n, ".2f", " N")
    delay = right.felt_delay_ms  # unknown where something came late in every press
    after = "" if delay is None else f", half of it {delay:.0f} ms later"
    action = "drag" if result.friction else "press"
    least = result.least_felt
    if least is not None and least < FELT:
        other = _number(left.felt_from_others_n, ".2f", " N")
        return (
            f"Too weak to feel: {felt} of {left.name}'s press for {right.name}, and {other} of"
            f" {right.name}'s for {left.name}; a hand clearly feels {FELT:g} N.\n"
            f"{_outcome(result)} ({how})."
        )
    return (
        f"{right.name} felt {left.name} {action} with {felt}{after}.\n{_outcome(result)} ({how})."
    )


def _too_short(result: DemoResult, how: str) -> str:
    """Return in words that no verdict is possible yet, and after which time it is."""
    action = "drag" if result.friction else "press"
    whole = f"no whole {action} was seen"
    seen = "not every force had the time to rest" if result.presses else whole
    enough = math.ceil(result.enough_s)
    return f"Too short to tell: {seen} ({how}). Let it run for {enough} s: --duration {enough}."


def _outcome(result: DemoResult) -> str:
    """Return in words whether the forces came to rest, and how far they are from equilibrium."""
    errors = [user.force_error for user in result.users if user.force_error is not None]
    off = f"at most {max(errors):.1%} from the truth" if errors else "and there is no truth to it"
    creeping = _names(u for u in result.users if u.rest is Rest.SLOW)
    if creeping:
        return f"Slow: the force of {creeping} still creeps to its value, {off}"
    softer = _names(u for u in result.users if u.soft)
    if softer:
        return f"Soft: every force came to rest, and the device of {softer} is the softer, {off}"
    if max(errors, default=0.0) > GOOD_ERROR:
        return f"The forces came to rest, and not where they should: up to {max(errors):.1%} off"
    return f"Every force came to rest, {off}"


def _lateness(result: DemoResult) -> str:
    """Return in words the largest lateness of a patch or of a haptic period."""
    patch = max(result.users, key=lambda user: user.patch_late_ms or 0.0)
    stall = max(result.users, key=lambda user: user.loop_stall_ms or 0.0)
    late, stood = patch.patch_late_ms or 0.0, stall.loop_stall_ms or 0.0
    if stood > late:
        return f"the haptic loop of {stall.name} stood still for {stood:.0f} ms"
    return f"a patch for {patch.name} came {late:.0f} ms late"


def _names(users: Iterable[UserResult]) -> str:
    return ", ".join(user.name for user in users)


def _number(value: float | None, form: str, unit: str = "") -> str:
    return "?" if value is None else f"{value:{form}}{unit}"
