"""All that happens to the forces of a room's users in one tick of the server, in order.

Each stage has its name, what it does and why, and the constant with which it works.
"""

from __future__ import annotations

from typing import Final

from cohaptic_server.world.stages.forces import bound_rate, go_ahead, lag, limit
from cohaptic_server.world.stages.hands import release, take_part, track
from cohaptic_server.world.stages.patches import build_patches, move_models
from cohaptic_server.world.stages.room import couple, plan, show
from cohaptic_server.world.stages.stage import Stage
from cohaptic_server.world.stages.surfaces import observe, respond

CHAIN: Final[tuple[Stage, ...]] = (
    Stage(
        "presence",
        take_part,
        "a user's force comes and goes with its user over this time: a pulled cable makes nobody's "
        "force jump",
        "RELEASE_TIME s",
    ),
    Stage(
        "track",
        track,
        "each contact follows its probe over the surface without the user's own force, and the "
        "delay of the user's loop is measured; a probe higher above the surface than this presses "
        "nothing",
        "MAX_CONTACT_HEIGHT m",
    ),
    Stage(
        "release",
        release,
        "a contact that jumps further than a hand leaves its force behind, to fade there: a jump "
        "of a force is felt by everybody else",
        "RELEASE_TIME s",
    ),
    Stage(
        "limit",
        limit,
        "no force dents the body deeper than so many of its radii, and all together are bounded, "
        "the largest cut first: a linear body has no limit of its own",
        "MAX_INDENTATION radii",
    ),
    Stage(
        "anticipate",
        go_ahead,
        "the body gets the forces that hands are about to feel, once nobody has come or gone for "
        "so long: hands that answer each other a round trip late would need a longer lag",
        "CALM_TIME s",
    ),
    Stage(
        "lag",
        lag,
        "forces pass the room's lag, with which the loop of all hands is stable at the delays that "
        "were measured; the first force of a hand among others passes this one at least",
        "FIRST_LAG s",
    ),
    Stage(
        "rate",
        bound_rate,
        "all others together change the force on one hand no faster than this, and those who "
        "change it most are slowed: a hand must not be shaken",
        "EFFECT_RATE N/s",
    ),
    Stage(
        "respond",
        respond,
        "the body answers all forces at once: whoever were served first would press on another "
        "surface",
    ),
    Stage(
        "observe",
        observe,
        "each user is shown the surface free of its own force, since its loop computes its own "
        "dent without delay; a neighbour counts in full from this height on",
        "NEAR_HEIGHT m",
    ),
    Stage(
        "couple",
        couple,
        "how far a force at each contact moves the others: with it hands close a loop",
    ),
    Stage(
        "plan",
        plan,
        "the part of that loop to anticipate in the next tick, and the lag that the rest needs, "
        "which rises at once and falls slowly",
        "FALL_RATE s/s",
    ),
    Stage(
        "swing",
        show,
        "a body with mass swings: hands are shown only the share of it that their loop can bear, "
        "since they drive what they feel; other bodies pass unchanged",
        "RISE 1/s",
    ),
    Stage(
        "models",
        move_models,
        "clients that move models of a hand get what it would do without any force; a hand's "
        "largest gain is cut where others' tips stiffen its contact; models lose their share where "
        "nothing is proved, or while a link's delay wavers by more than this",
        "STEADY s",
    ),
    Stage(
        "patches",
        build_patches,
        "one surface, and gains that are stable at the user's delay, for each user",
    ),
)
