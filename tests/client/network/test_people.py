from __future__ import annotations

from cohaptic.protocol.messages import BodyInfo, UserJoined, UserLeft, Welcome
from cohaptic_client.network.conversation import People

BODY = BodyInfo(name="balloon", center=(0.0, 0.0, 0.0), radius=0.1, contact_radius=0.02)


def people(*users: str) -> People:
    welcome = Welcome(user=5, name="me", simulation_period=0.0625, body=BODY, users=users)
    return People(welcome)


def test_one_who_comes_joined_and_by_another_name_is_now_called_that() -> None:
    room = people()
    assert room.news(UserJoined(user=6, name="ann")) == "ann joined"
    assert room.news(UserJoined(user=6, name="bob")) == "ann is now called bob"
    assert room.news(UserJoined(user=6, name="cid")) == "bob is now called cid"
    assert room.news(UserLeft(user=6, name="cid", reason="tired")) == "cid left: tired"
    assert room.news(UserJoined(user=7, name="ann")) == "ann joined"


def test_of_one_who_was_there_before_the_name_is_known_where_there_was_one() -> None:
    room = people("ann")
    assert room.news(UserJoined(user=2, name="bob")) == "ann is now called bob"
    assert room.news(UserJoined(user=2, name="ann")) == "bob is now called ann"


def test_of_several_who_were_there_before_nobody_is_named_who_may_be_another() -> None:
    room = people("ann", "bob")
    said = "somebody who was here before you is now called cid"
    assert room.news(UserJoined(user=2, name="cid")) == said
    assert room.news(UserJoined(user=2, name="dan")) == "cid is now called dan"


def test_who_is_left_of_several_is_named() -> None:
    room = people("ann", "bob")
    room.news(UserLeft(user=1, name="ann", reason="left"))
    assert room.news(UserJoined(user=2, name="cid")) == "bob is now called cid"
