"""A room has one owner at a time, whatever is lost, late, paused or started again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

from hypothesis import example, given
from hypothesis import strategies as st

from cohaptic_ops.cluster.leases import NEVER, Claims, Witness

TERM = 2.0
ROOM = "room"
NODES, WITNESSES = 3, 3
FAST = 1.02  # of the fastest clock beside the slowest: 1/FAST
AGAIN = "started again"  # reason of a restart


@dataclass
class _Node:
    name: str
    rate: float
    claims: Claims = field(default_factory=lambda: Claims(WITNESSES, TERM))


@dataclass
class _Ask:
    node: int
    witness: int
    sent: float
    asked: dict[str, int]


@dataclass
class _Cluster:
    """Nodes and witnesses whose clocks run at different rates, and the messages between them."""

    rates: Sequence[float]
    now: float = 100.0
    asks: list[_Ask] = field(default_factory=list[_Ask])
    answers: list[tuple[_Ask, dict[str, int], dict[str, int]]] = field(
        default_factory=list[tuple[_Ask, dict[str, int], dict[str, int]]]
    )
    # The newest number of an owner, and that owner.
    newest: tuple[int, int] = (0, 0)

    def __post_init__(self) -> None:
        self.nodes = [_Node(f"p{k}", self.rates[k]) for k in range(NODES)]
        self.witnesses = [self.new_witness(k) for k in range(WITNESSES)]

    def new_witness(self, k: int) -> Witness:
        return Witness([ROOM], TERM, self.now * self.rates[NODES + k])

    def clock(self, node: int) -> float:
        return self.now * self.nodes[node].rate

    def ask(self, node: int, witness: int) -> None:
        claims = self.nodes[node].claims
        self.asks.append(_Ask(node, witness, self.clock(node), claims.asked))

    def reach(self, which: int) -> None:
        if not self.asks:
            return
        ask = self.asks.pop(which % len(self.asks))
        name = self.nodes[ask.node].name
        now = self.now * self.rates[NODES + ask.witness]
        answer = self.witnesses[ask.witness].grant(name, f"of {name}", ask.asked, now)
        self.answers.append((ask, *answer))

    def come_back(self, which: int) -> None:
        if not self.answers:
            return
        ask, granted, refused = self.answers.pop(which % len(self.answers))
        claims = self.nodes[ask.node].claims
        claims.heard(str(ask.witness), ask.sent, granted, refused)

    def exchange(self, node: int) -> None:
        """Ask all witnesses, without any delay."""
        for witness in range(WITNESSES):
            self.ask(node, witness)
            self.reach(len(self.asks) - 1)
            self.come_back(len(self.answers) - 1)
        self.settle(node)

    def settle(self, node: int) -> Sequence[str]:
        gained, lost, failed = self.nodes[node].claims.settle(self.clock(node))
        for witness in self.witnesses if failed else []:
            witness.free(self.nodes[node].name, {ROOM: self.nodes[node].claims.last(ROOM)})
        epoch = self.nodes[node].claims.epoch(ROOM, self.clock(node))
        if gained:
            assert epoch is not None
            assert epoch > self.newest[0] or node == self.newest[1]
            self.newest = (epoch, node)
        return lost

    def give_back(self, node: int) -> None:
        """End the room, and tell all witnesses so."""
        self.nodes[node].claims.drop(ROOM)
        for witness in self.witnesses:
            witness.free(self.nodes[node].name, {ROOM: self.nodes[node].claims.last(ROOM)})

    def owners(self) -> list[int]:
        clocks = [self.clock(k) for k in range(NODES)]
        return [k for k in range(NODES) if self.nodes[k].claims.epoch(ROOM, clocks[k]) is not None]


_NODE, _WITNESS = st.integers(0, NODES - 1), st.integers(0, WITNESSES - 1)
_WHICH = st.integers(0, 9)
_EVENTS = st.one_of(
    st.tuples(st.just("pass"), st.floats(0.0, 2.2)),
    st.tuples(st.just("exchange"), _NODE),
    st.tuples(st.just("ask"), _NODE, _WITNESS),
    st.tuples(st.just("reach"), _WHICH),
    st.tuples(st.just("come_back"), _WHICH),
    st.tuples(st.just("lose"), _WHICH),
    st.tuples(st.just("want"), _NODE),
    st.tuples(st.just("settle"), _NODE),
    st.tuples(st.just("give_back"), _NODE),
    st.tuples(st.just(AGAIN), _WITNESS),
)
_RATES = st.lists(st.floats(1.0 / FAST, FAST), min_size=6, max_size=6)


def _happen(cluster: _Cluster, event: tuple[str, float] | tuple[str, int, int]) -> None:
    match event:
        case ("pass", seconds):
            cluster.now += seconds
        case ("exchange", node):
            cluster.exchange(int(node))
        case ("ask", node, witness):
            cluster.ask(int(node), witness)
        case ("reach", which):
            cluster.reach(int(which))
        case ("come_back", which):
            cluster.come_back(int(which))
        case ("lose", which):
            if cluster.asks:
                cluster.asks.pop(int(which) % len(cluster.asks))
        case ("want", node):
            cluster.nodes[int(node)].claims.want(ROOM, cluster.clock(int(node)))
        case ("settle", node):
            cluster.settle(int(node))
        case ("give_back", node):
            cluster.give_back(int(node))
        case _:
            k = int(event[1])
            cluster.witnesses[k] = cluster.new_witness(k)


# A witness forgets its promise while the owner still counts on it.
_FORGETS = [
    ("pass", 3.0), ("want", 0), ("want", 1), ("exchange", 0),
    (AGAIN, 0), (AGAIN, 1), ("exchange", 1), ("want", 1), ("exchange", 1), ("exchange", 1),
]  # fmt: skip
# A process was paused for longer than its lease, and an answer of before comes when it wakes up.
_PAUSED = [
    ("pass", 3.0), ("want", 0), ("exchange", 0), ("ask", 0, 0), ("ask", 0, 1), ("pass", 2.2),
    ("want", 1), ("exchange", 1), ("exchange", 1), ("reach", 0), ("reach", 0),
    ("come_back", 0), ("come_back", 0), ("settle", 0),
]  # fmt: skip
# Two processes are each cut off from one witness more than they can do without.
_ALONE = [
    ("ask", 0, 0), ("reach", 0), ("come_back", 0), ("settle", 0),
    ("ask", 1, 1), ("reach", 0), ("come_back", 0), ("settle", 1),
]  # fmt: skip
# A question of an owner reaches one witness only after two others have owned the room.
_LATE = [
    ("exchange", 0), ("ask", 0, 0), ("ask", 0, 1), ("pass", 2.2), ("exchange", 1), ("exchange", 1),
    ("settle", 0), ("pass", 2.2), ("reach", 0), ("reach", 0), ("pass", 2.2),
    ("exchange", 2), ("exchange", 2),
]  # fmt: skip


@given(_RATES, st.lists(_EVENTS, max_size=60))
@example([1.0] * 6, _ALONE)
@example([1.0] * 6, _LATE)
@example([1.0] * 6, _FORGETS)
@example([1.0] * 6, _PAUSED)
@example([1 / FAST, FAST, 1.0, FAST, FAST, FAST], [("pass", 3.0), ("want", 0), ("exchange", 0),
    ("pass", 2.0), ("want", 1), ("exchange", 1), ("exchange", 1)])  # fmt: skip
def test_a_room_has_at_most_one_owner_whatever_happens(
    rates: list[float], events: list[tuple[str, float] | tuple[str, int, int]]
) -> None:
    cluster = _Cluster(rates)
    # Wants that are there from the beginning make owners likelier.
    cluster.now += 3.0
    for node in range(NODES):
        cluster.nodes[node].claims.want(ROOM, cluster.clock(node))
    for event in events:
        _happen(cluster, event)
        assert len(cluster.owners()) <= 1


@given(_RATES, st.lists(_EVENTS, max_size=30))
def test_after_any_history_a_room_finds_an_owner(
    rates: list[float], events: list[tuple[str, float] | tuple[str, int, int]]
) -> None:
    cluster = _Cluster(rates)
    for event in events:
        _happen(cluster, event)
    cluster.asks.clear()
    cluster.answers.clear()
    for _ in range(40):
        for node in range(NODES):
            if node == 0 or cluster.owners() == [node]:
                cluster.nodes[node].claims.want(ROOM, cluster.clock(node))
                cluster.exchange(node)
        cluster.now += TERM / 5.0
    assert len(cluster.owners()) == 1


@given(st.integers(0, 10**6))
def test_of_three_that_want_a_room_at_once_one_gets_it_soon(seed: int) -> None:
    chance = Random(seed)
    cluster = _Cluster([1.0] * 6)
    cluster.now += 3.0
    after = [0.0] * NODES
    for _ in range(300):
        for node in range(NODES):
            if cluster.now >= after[node]:
                cluster.nodes[node].claims.want(ROOM, cluster.clock(node))
            for witness in range(WITNESSES):
                cluster.ask(node, witness)
        while cluster.asks:
            cluster.reach(chance.randrange(len(cluster.asks)))
        while cluster.answers:
            cluster.come_back(chance.randrange(len(cluster.answers)))
        for node in range(NODES):
            cluster.settle(node)
            if ROOM not in cluster.nodes[node].claims.asked and cluster.now >= after[node]:
                after[node] = cluster.now + 0.3 * chance.random()
        if cluster.owners():
            break
        cluster.now += 0.02
    assert len(cluster.owners()) == 1


def test_the_owner_after_a_dead_one_has_a_higher_number_and_comes_within_a_term() -> None:
    cluster = _Cluster([1.0] * 6)
    cluster.now += 3.0
    cluster.nodes[0].claims.want(ROOM, cluster.clock(0))
    cluster.exchange(0)
    assert cluster.owners() == [0]
    first = cluster.nodes[0].claims.epoch(ROOM, cluster.clock(0))
    died = cluster.now
    while cluster.owners() != [1]:
        cluster.now += 0.1
        cluster.nodes[1].claims.want(ROOM, cluster.clock(1))
        cluster.exchange(1)
        assert cluster.now < died + 1.1 * TERM
    second = cluster.nodes[1].claims.epoch(ROOM, cluster.clock(1))
    assert first is not None
    assert second is not None
    assert second > first
    # The dead one was only paused: what it asks for now is refused, and it knows that it lost.
    cluster.exchange(0)
    assert cluster.owners() == [1]
    assert cluster.nodes[0].claims.until(ROOM) == NEVER


def test_an_owner_that_is_refused_by_one_witness_keeps_its_room_and_is_granted_it_again() -> None:
    cluster = _Cluster([1.0] * 6)
    cluster.now += 3.0
    cluster.nodes[0].claims.want(ROOM, cluster.clock(0))
    cluster.exchange(0)
    cluster.witnesses[0] = cluster.new_witness(0)  # it forgets, and another comes first
    cluster.now += 0.5
    cluster.exchange(0)  # the two others renew, while that one is silent
    cluster.now += 1.7
    cluster.nodes[1].claims.want(ROOM, cluster.clock(1))
    cluster.exchange(1)
    cluster.nodes[1].claims.want(ROOM, cluster.clock(1))
    cluster.exchange(1)
    for _ in range(3):
        cluster.exchange(0)
    # Without one of the two others it still has a majority.
    cluster.witnesses[1].free(cluster.nodes[0].name, {ROOM: 99})
    cluster.witnesses[1] = cluster.new_witness(1)
    cluster.now += 1.5
    cluster.exchange(0)
    assert cluster.owners() == [0]


def test_a_late_word_that_a_room_is_free_does_not_free_a_later_grant() -> None:
    witness = Witness([ROOM], TERM, 0.0)
    claims = Claims(1, TERM)
    claims.want(ROOM, 3.0)
    claims.drop(ROOM)
    freed = {ROOM: claims.last(ROOM)}
    claims.want(ROOM, 3.1)
    granted, _ = witness.grant("p", "a", claims.asked, 3.2)
    assert granted == claims.asked
    witness.free("p", freed)
    assert witness.owner(ROOM, 3.3) is not None


def test_a_witness_grants_only_rooms_of_the_configuration() -> None:
    witness = Witness([ROOM], TERM, 0.0)
    granted, refused = witness.grant("p", "a", {"other": 1, ROOM: 1}, 3.0)
    assert (granted, refused) == ({ROOM: 1}, {"other": 0})
    assert witness.owner("other", 3.0) is None
