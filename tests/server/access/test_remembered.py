from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.access.remembered import (
    LONGEST,
    MAX_REMOVED,
    Pardon,
    Record,
    Removal,
    Used,
    decode,
    encode,
    still_counting,
)

TIMES = st.floats(-1e9, 1e12)
USED = st.builds(Used, jti=st.text(max_size=64), ends=TIMES)
REMOVALS = st.builds(
    Removal,
    session=st.text(max_size=64),
    invitation=st.text(max_size=64),
    name=st.text(max_size=64),
    source=st.text(max_size=64),
    at=TIMES,
    until=st.none() | TIMES,
)


@given(st.one_of(USED, REMOVALS))
def test_what_is_written_is_read(record: Record) -> None:
    line = encode(record)
    assert line.count(b"\n") == 1
    assert line.endswith(b"\n")
    assert decode(line) == record


@given(st.binary(max_size=200), USED, st.integers(0, 60))
def test_any_bytes_are_a_record_or_none(noise: bytes, record: Used, at: int) -> None:
    decode(noise)
    line = encode(record)
    decode(line[:at] + noise + line[at:])
    if at < len(line) - 2:
        assert decode(line[:at]) is None
    assert decode(encode(record)[:-2] + b" " * LONGEST + b"}") is None


@given(st.lists(st.one_of(USED, REMOVALS), max_size=40), TIMES, TIMES)
def test_what_counts_is_the_same_however_often_it_is_sorted_out(
    records: list[Record], one: float, other: float
) -> None:
    early, late = sorted((one, other))
    kept = still_counting(still_counting(records, early), late)
    assert kept == still_counting(records, late)
    bans = [r for r in records if isinstance(r, Removal) and r.until is None]
    assert [r for r in kept if isinstance(r, Removal) and r.until is None] == bans


def test_the_newest_who_were_put_out_are_kept() -> None:
    removals = [
        Removal(session=str(i), invitation="", name="", source="", at=0.0, until=None)
        for i in range(2 * MAX_REMOVED)
    ]
    assert still_counting(removals, 0.0) == removals[MAX_REMOVED:]


FEW = st.sampled_from("abc")
PUT_OUT = st.builds(
    Removal, session=FEW, invitation=FEW, name=FEW, source=FEW, at=st.just(0.0), until=st.none()
)
PARDONS = st.builds(Pardon, name=FEW, at=st.just(0.0))


@given(st.lists(st.one_of(PUT_OUT, PARDONS), max_size=30))
def test_a_pardon_takes_back_what_was_before_it_by_its_name_and_nothing_else(
    records: list[Record],
) -> None:
    staying: list[Removal] = []
    for record in records:
        if isinstance(record, Removal):
            staying.append(record)
        elif isinstance(record, Pardon):
            staying = [one for one in staying if one.name != record.name]
    assert still_counting(records, 1.0) == staying
