from __future__ import annotations

from cohaptic.protocol.messages import BodyInfo, RoomUser, UserJoined, UserLeft, Welcome
from cohaptic_client.network.conversation import People

BODY = BodyInfo(name="balloon", center=(0.0, 0.0, 0.0), radius=0.1, contact_radius=0.02)


def people(*users: str) -> People:
    there = tuple(RoomUser(user=k, name=name) for k, name in enumerate(users, start=1))
    welcome = Welcome(user=5, name="me", simulation_period=0.0625, body=BODY, users=there)
    return People(welcome)


def test_one_who_comes_joined_and_by_another_name_is_now_called_that() -> None:
    room = people()
    assert room.news(UserJoined(user=6, name="ann")) == "ann joined"
    assert room.news(UserJoined(user=6, name="bob")) == "ann is now called bob"
    assert room.news(UserJoined(user=6, name="cid")) == "bob is now called cid"
    assert room.news(UserLeft(user=6, name="cid", reason="tired")) == "cid left: tired"
    assert room.news(UserJoined(user=7, name="ann")) == "ann joined"


def test_one_who_was_there_before_is_known_by_name_and_number() -> None:
    room = people("ann", "bob")
    assert room.news(UserJoined(user=2, name="cid")) == "bob is now called cid"
    assert room.news(UserLeft(user=1, name="ann", reason="bye")) == "ann left"
    assert room.news(UserJoined(user=6, name="bob")) == "bob joined"
