"""Control messages of the golden vectors, by name."""

from __future__ import annotations

from typing import Any

from cohaptic.control.law import Law
from cohaptic.protocol.control.company import (
    Aim,
    Aimed,
    Company,
    Declined,
    Follow,
    Follower,
    Point,
    Pointed,
    Present,
)
from cohaptic.protocol.control.message import LoopRules, Named, SetName
from cohaptic.protocol.messages import (
    BodyInfo,
    Bye,
    Called,
    Come,
    Error,
    Hello,
    Mark,
    Place,
    Recorded,
    Restraints,
    RoomUser,
    SetLaw,
    UserJoined,
    UserLeft,
    Welcome,
)
from cohaptic.protocol.version import PROTOCOL_VERSION
from cohaptic.protocol.watch_messages import (
    Latency,
    Moderate,
    Moderated,
    PutOut,
    SetLatency,
    SetView,
    Watch,
    Watching,
)

CONTROL: dict[str, Any] = {
    "hello": Hello(protocol=PROTOCOL_VERSION, name="left"),
    "hello with a token": Hello(
        protocol=PROTOCOL_VERSION, name="left", key="0123456789abcdef", token="eyJh.eyJz.c2ln"
    ),
    "come": Come(),
    "place": Place(place=2, of=3),
    "place with a session": Place(place=3, of=3, session="eyJh.eyJz.c2Vz"),
    "called": Called(within=5.0),
    "set_name": SetName(name="far left"),
    "named": Named(name="left", reason="name is 'up'; expected one that is free"),
    "set_law": SetLaw(law=Law.PI),
    "bye": Bye(),
    "welcome": Welcome.model_validate(
        {
            "user": 2,
            "name": "right",
            "simulation_period": 0.0625,
            "to_wall": 1.75e9,
            "body": {
                "name": "balloon",
                "center": (0.0, 0.0, 0.0),
                "radius": 0.1,
                "contact_radius": 0.02,
            },
            "users": (RoomUser(user=1, name="left"),),
        }
    ),
    "welcome with a session": Welcome(
        user=3,
        name="up",
        simulation_period=0.0625,
        users=(),
        session="eyJh.eyJz.c2Vz",
        body=BodyInfo(name="spring", center=(0.0, 0.0, 0.0), radius=0.15, contact_radius=0.02),
    ),
    "user_joined": UserJoined(user=2, name="right"),
    "user_joined with rules": UserJoined(
        user=2, name="right", rules=LoopRules(added=("edge",), lacking=("models", "trust"))
    ),
    "user_left": UserLeft(user=2, name="right", reason="bye"),
    "error": Error(
        code=4409, field="name", message="name is 'left'; expected one that is free (taken: left)"
    ),
    "watch": Watch(protocol=PROTOCOL_VERSION, mesh="quantised"),
    "watch with company": Watch(protocol=PROTOCOL_VERSION, company=True),
    "watch with a token": Watch(protocol=PROTOCOL_VERSION, token="eyJh.eyJz.c2ln"),
    "set_view": SetView(encoding="forces", rate=60.0),
    "set_latency": SetLatency(user=2, delay=0.125, jitter=0.03125, network="wifi"),
    "moderate": Moderate(action="kick", user=2),
    "watching": Watching(
        simulation_period=0.0625,
        to_wall=1.75e9,
        body=BodyInfo(
            name="balloon",
            center=(0.0, 0.0, 0.0),
            radius=0.1,
            contact_radius=0.02,
            origin=(12.0, 0.0, -0.5),
        ),
        model="00112233445566778899aabbccddeeff",
        users=(
            RoomUser(user=1, name="left", rules=LoopRules(added=("edge",))),
            RoomUser(user=2, name="right"),
        ),
        allow_latency=True,
        allow_fixed_gains=False,
    ),
    "watching without a model": Watching(
        simulation_period=0.0625,
        body=BodyInfo(name="spring", center=(0.0, 0.0, 0.0), radius=0.15, contact_radius=0.02),
        model=None,
        users=(),
        allow_latency=False,
        allow_fixed_gains=True,
        can_touch=False,
        room_admin=True,
        session="eyJh.eyJz.c2Vz",
    ),
    "recorded": Recorded(on=True),
    "mark": Mark(
        text="stimulus on",
        fields={"trial": 3, "side": "left", "valid": True},
        at=1234.5,
        error=0.015625,
        ago=0.25,
    ),
    "restraints": Restraints(frozen=True, muted=(1, 3)),
    "moderated": Moderated(action="ban", user=3, done=False),
    "moderate a name": Moderate(action="unban", name="left"),
    "put_out": PutOut(names=("left", "right")),
    "latency": Latency(user=2, delay=0.125, jitter=0.03125, network="wifi"),
    "present": Present(name="left", user=1, key="0123456789abcdef", open=True),
    "present without a hand": Present(name="left"),
    "follow": Follow(user=2),
    "follow nobody": Follow(user=None),
    "aim": Aim(azimuth=-1.375, elevation=0.25, distance=5.5),
    "point": Point(point=(0.0625, 0.0, -0.125)),
    "company": Company(
        watching=3,
        open=(1, 2),
        following=2,
        followers=(Follower(user=1, name="left"), Follower(user=None, name="up")),
    ),
    "company of nobody": Company(watching=1, may_point=False),
    "aimed": Aimed(user=2, azimuth=-1.375, elevation=0.25, distance=5.5),
    "pointed": Pointed(user=2, name="right", point=(0.0625, 0.0, -0.125)),
    "declined": Declined(what="follow", reason="right keeps its view to itself."),
}

# What is said over a connection that watches, by the titles of its parts in docs/protocol.md.
SOCIAL = [
    (f"{kind.__name__.lower()},", kind)
    for kind in (
        Moderated,
        Watching,
        Latency,
        Present,
        Follow,
        Aim,
        Point,
        Company,
        Aimed,
        Pointed,
        Declined,
    )
]
