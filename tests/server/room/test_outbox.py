from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cohaptic_server.room.outbox import MAX_EVENTS, Outbox

# What happens at an outbox, in any order: an event, a patch, or a chance to write.
happenings = st.lists(st.sampled_from(["event", "patch", "clear", "blocked"]), max_size=300)


@given(happenings)
def test_events_keep_order_and_patches_are_the_newest(order: list[str]) -> None:
    outbox = Outbox()
    queued: list[str] = []
    written: list[str | bytes] = []
    newest, patches = 0, 0
    for number, what in enumerate(order, start=1):
        if what == "event" and outbox.put_event(str(number)):
            queued.append(str(number))
        elif what == "patch":
            outbox.put_patch(number.to_bytes(2, "big"))
            newest, patches = number, patches + 1
        elif what == "clear":
            taken = outbox.take(clear=True)
            assert [t for t in taken[:-1] if isinstance(t, bytes)] == []
            if taken and isinstance(taken[-1], bytes):
                assert int.from_bytes(taken[-1], "big") == newest
            written += taken
        elif what == "blocked":
            assert outbox.take(clear=False) == []
    written += outbox.take(clear=True)
    assert [w for w in written if isinstance(w, str)] == queued
    frames = [int.from_bytes(w, "big") for w in written if isinstance(w, bytes)]
    assert frames == sorted(set(frames))
    assert len(frames) + outbox.patches_skipped == patches


@given(st.integers(0, 3 * MAX_EVENTS), st.integers(0, 1000))
def test_a_client_that_reads_nothing_costs_a_bounded_amount(events: int, patches: int) -> None:
    outbox = Outbox()
    kept = [outbox.put_event(str(i)) for i in range(events)]
    for _ in range(patches):
        outbox.put_patch(b"patch")
    assert kept == [i < MAX_EVENTS for i in range(events)]
    assert len(outbox.take(clear=True)) == min(events, MAX_EVENTS) + min(patches, 1)


def test_what_was_taken_is_gone_and_there_is_room_again() -> None:
    outbox = Outbox()
    for _ in range(MAX_EVENTS):
        assert outbox.put_event("news")
    assert not outbox.put_event("one too many")
    outbox.take(clear=True)
    assert outbox.put_event("again")
    assert outbox.take(clear=True) == ["again"]
    assert outbox.take(clear=True) == []
