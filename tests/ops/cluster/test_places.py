"""What the engine has to do, in a time that is an argument."""

from __future__ import annotations

from collections.abc import Mapping

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_ops.cluster.lines import Command
from cohaptic_ops.cluster.places import Places, share_out

CORES = {"always": 0.5, "rare": 0.25}
NODE = {"rare": "10.0.0.2:8764"}
NOBODY: Mapping[str, str] = {}


def places() -> Places:
    return Places(CORES, ["always"])


def test_a_room_that_always_runs_is_placed_and_another_when_somebody_asks() -> None:
    there = places()
    assert there.commands({}, NOBODY, 0.0) == [Command(place="always", cores=0.5)]
    there.want("rare", 3.0)
    there.want("not in the configuration", 3.0)
    reported = there.commands({"always": "10.0.0.1"}, {"always": "10.0.0.1:8764"}, 3.0)
    assert reported == [Command(place="rare", cores=0.25)]


def test_a_room_where_no_server_runs_is_placed_anew_and_sooner_where_it_has_no_machine() -> None:
    for machine, seconds in (("10.0.0.2", 9.0), ("", 2.0)):
        there = places()
        placed = {"always": machine}
        assert there.commands(placed, NOBODY, 10.0) == []
        assert there.commands(placed, NOBODY, 10.9) == []
        assert there.commands(placed, NOBODY, 10.0 + seconds) == [Command(remove="always")]
        assert there.commands(placed, NOBODY, 10.1 + seconds) == []
        # As soon as that has taken effect.
        reported = there.commands({}, NOBODY, 10.2 + seconds)
        assert reported == [Command(place="always", cores=0.5)]


def test_an_engine_that_has_lost_its_memory_is_told_where_rooms_are() -> None:
    reported = places().commands({"always": "10.0.0.1"}, NODE | {"always": "10.0.0.1:8764"}, 0.0)
    assert reported == [Command(place="rare", cores=0.25, at="10.0.0.2")]


@given(
    st.lists(st.tuples(st.floats(0.0, 5.0), st.booleans(), st.booleans(), st.booleans())),
)
def test_no_room_is_removed_whose_owner_is_where_it_was_placed(
    history: list[tuple[float, bool, bool, bool]],
) -> None:
    there, now = places(), 0.0
    for pause, asked, placed, owned in history:
        now += pause
        if asked:
            there.want("rare", now)
        reported = there.commands(
            {"rare": "10.0.0.2"} if placed else {}, NODE if owned else NOBODY, now
        )
        assert not (owned and any(command.remove == "rare" for command in reported))


@given(
    processors=st.dictionaries(st.sampled_from("abcde"), st.integers(0, 40), max_size=5),
    needed=st.lists(st.integers(1, 8), max_size=30),
    owners=st.lists(st.sampled_from("abcdef"), max_size=8),
)
def test_rooms_are_shared_out_as_evenly_as_they_fit(
    processors: dict[str, int], needed: list[int], owners: list[str]
) -> None:
    # In tenths, whose sums are not exact.
    cores = {f"room{k}": need / 10.0 for k, need in enumerate(needed)}
    machines = {machine: count / 10.0 for machine, count in processors.items()}
    owned = dict(zip(cores, owners, strict=False))
    vacant = cores.keys() - owned.keys()
    shares = share_out(vacant, machines, owned, cores)
    again = dict(reversed(machines.items()))
    assert shares == share_out(sorted(vacant, reverse=True), again, owned, cores)
    assert shares.keys() <= vacant
    there = owned | shares
    left = {
        machine: count - sum(round(10 * cores[room]) for room in there if there[room] == machine)
        for machine, count in processors.items()
    }
    last = {machine: room for room, machine in sorted(shares.items())}
    for machine, room in last.items():
        assert left[machine] >= 0
        # Each room went where most was left: the last one on a machine shows it.
        assert left[machine] + round(10 * cores[room]) >= max(left.values())
    # Where a room has got no machine, none has enough left.
    for room in vacant - shares.keys():
        assert all(count < round(10 * cores[room]) for count in left.values())
