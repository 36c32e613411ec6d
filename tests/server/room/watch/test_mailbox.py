from __future__ import annotations

from cohaptic_server.room.watch.watcher import MAX_POINTED, Mailbox


def test_newer_news_takes_the_place_of_older_news_and_is_heard_once() -> None:
    box = Mailbox()
    for text in ("old", "new"):
        box.put_company(f"company {text}")
        box.put_aimed(f"aimed {text}")
        box.put_pointed("ann", f"ann {text}")
    assert box.take() == ["company new", "aimed new", "ann new"]
    assert box.take() == []


def test_what_waits_is_bounded_and_who_pointed_first_is_left_out() -> None:
    box = Mailbox()
    for who in range(MAX_POINTED + 5):
        box.put_pointed(who, str(who))
    box.put_pointed(5, "5 again")
    kept = [str(who) for who in range(6, MAX_POINTED + 5)]
    assert box.take() == [*kept, "5 again"]
