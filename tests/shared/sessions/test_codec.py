from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.sessions.codec import decode, encode
from cohaptic.sessions.entries import BudgetSet, Joined, Mark, Rows, Shown, Written
from cohaptic.sessions.schemas import BY_ENTRY, CHANNELS, Channel
from tests.shared.sessions.made import T, as_read, info, rows, written


@given(written)
def test_an_entry_is_what_its_message_says(entry: Written) -> None:
    assert decode(BY_ENTRY[type(entry)], encode(entry)) == as_read(entry)


def test_the_first_entry_is_what_its_message_says() -> None:
    assert decode(BY_ENTRY[type(info())], encode(info())) == info()


@given(st.sampled_from(CHANNELS), st.binary(max_size=60))
def test_any_bytes_are_an_entry_or_a_value_error(channel: Channel, data: bytes) -> None:
    try:
        entry = decode(channel, data)
    except ValueError:
        return
    assert type(entry) is channel.entry


def test_times_ticks_and_flags_are_kept_exactly() -> None:
    made = rows(T + 1 / 3, 40)
    found = decode(BY_ENTRY[Rows], encode(made))
    assert isinstance(found, Rows)
    before, after = (np.frombuffer(each.block).reshape(40, -1) for each in (made, found))
    for name in ("t", "tick", "reason"):
        i = made.columns.index(name)
        assert after[:, i].tolist() == before[:, i].tolist()
    assert after == pytest.approx(before, rel=6e-8)


def test_secrets_do_not_go_into_a_file() -> None:
    hello = {"name": "ann", "key": "k" * 20, "token": "ey.secret", "session": "s"}
    found = encode(Joined(T, 1, "ann", hello, 10.0))
    assert b"ann" in found
    for secret in (b"kkk", b"secret", b"session"):
        assert secret not in found


def test_values_of_a_mark_that_json_does_not_know_become_null() -> None:
    found = decode(BY_ENTRY[Mark], encode(Mark(T, "x", {"a": float("nan"), "b": [float("inf")]})))
    assert isinstance(found, Mark)
    assert found.fields == {"a": None, "b": [None]}


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (BudgetSet(float("nan"), 1.0), "t of an entry is nan"),
        (BudgetSet(T, float("inf")), "force of an entry is inf"),
        (replace(rows(T, 2), t=float("inf")), "t of an entry is inf"),
        (replace(rows(T, 2), user=-1), "no number of 64 bits"),
        (replace(rows(T, 2), block=b"1234567"), "buffer size"),
        (replace(rows(T, 2), columns=()), "no columns"),
        (replace(rows(T, 2), columns=("x", "t", "y") * 17), "begin with 't'"),
        (replace(rows(T, 2), columns=("t", "a\nb", *rows(T, 1).columns[2:])), "printable"),
        (Mark(T, "x", {"long": "x" * 5_000_000}), "bytes, more than 4194304"),
        (Shown(T, -1, b""), "no number of 64 bits"),
    ],
)
def test_what_cannot_be_read_again_is_not_written(entry: Written, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        encode(entry)


def test_a_value_of_another_type_is_not_written() -> None:
    with pytest.raises((ValueError, TypeError)):
        encode(Mark(T, 5, {}))  # type: ignore[arg-type]
    with pytest.raises((ValueError, TypeError)):
        encode(replace(rows(T, 1), to_server="x"))  # type: ignore[arg-type]
