"""The layout of every binary frame: one table for the codecs, for the page and for the docs.

A frame is little-endian and packed: the header, the fields of its kind, and parts behind them. The
codecs beside take their formats and sizes from this table; `make protocol` writes
`web/src/protocol/layout.ts`, the constants of `clients/cpp/cohaptic.hpp` and the tables of
`docs/protocol.md` from it. The haptic loop's process imports this module, so it needs neither numpy
nor pydantic.
"""

from __future__ import annotations

from typing import Final

from cohaptic.control.law import Law
from cohaptic.protocol.fields import Field, Frame, FrameKind, Layout


def _reserved(count: int) -> Field:
    return Field("reserved", "pad", count, "", "0; whatever comes is ignored")


_LENGTH = "length <= 10"  # of a place or a displacement [m], `MAX_POSITION`
_NEWTONS = "+-300"


def _ledger(meaning: str = "") -> tuple[Field, ...]:
    """Fields for what a tick made of a user's force.

    Args:
        meaning: In place of the meanings, where those are in another table; empty for none.
    """
    of = (
        (
            "by_presence",
            "who comes, leaves, is silent, has jumped or is too high above the surface",
        ),
        ("by_limit", "by the limits of the contact and of the body"),
        ("by_anticipation", "since the answers of the other hands are anticipated"),
        ("by_lag", "by the room's lag"),
        ("by_rate", "since the force on another hand would change too fast"),
    )
    first = "what the tick adds to the force that it had heard of: "
    fields = [
        Field(name, "f16", 1, "N", meaning or (first if i == 0 else "the same: ") + why, _NEWTONS,
              "ledger")
        for i, (name, why) in enumerate(of)
    ]  # fmt: skip
    cut = "what the gain `k_h` is less since models of others stiffen the contact; 6e4 for more"
    return (*fields, Field("gain_cut", "f16", 1, "N/m", meaning or cut, "0..6e4", "ledger"))


_GEOMETRIES = "1 plane, 2 sphere, 3 mesh"
_LAWS = ", ".join(f"{number} {law.value}" for number, law in enumerate(Law, 1))
_SHAPE = f"bits 0-3 `geometry`: {_GEOMETRIES}; bits 4-7 `law`: {_LAWS}"
_SHAPES = f"1..3, 1..{len(Law)}"

CONTACT_SAMPLE: Final = Layout(
    "contact_sample",
    "Position of the tip, and force on the hand.",
    (
        Field("seq", "u32", 1, "", "counts this client's samples, rising", ">= 1"),
        Field("tick", "u32", 1, "", "newest patch that the client used; 0 for none"),
        Field("t_client", "f64", 1, "s", "when it was taken, client's clock", "finite"),
        Field("probe", "f32", 3, "m", "tip, world frame", _LENGTH),
        Field("force", "f32", 3, "N", "on the hand, world frame", "length <= 100"),
    ),
    Frame(
        FrameKind.CONTACT_SAMPLE,
        "client to server",
        "bit 0: the `anchor` follows; bit 1: the `deflection` follows, behind it; bit 2, only with "
        "bit 1: the `own_model` follows, behind both",
        "others 0",
    ),
)

ANCHOR: Final = Layout(
    "anchor",
    "Behind a contact sample with friction and in contact.",
    (
        Field(
            "anchor", "f32", 3, "m",
            "point of the resting surface that the finger holds, world frame", _LENGTH,
        ),
    ),
)  # fmt: skip

DEFLECTION: Final = Layout(
    "deflection",
    "Behind a contact sample of a client that moves models of the hands, or simulates its own.",
    (
        Field(
            "deflection", "f32", 1, "m",
            "displacement of the model of this client's own hand, out of the body, by the forces "
            "on the hand before `t_client`",
            "+-10",
        ),
    ),
)  # fmt: skip

_MODEL = (
    Field("mass", "f32", 1, "kg", "of the model", "0.03..0.8"),
    Field("damping", "f32", 1, "N s/m", "of the model", "0.5..100"),
    Field("stiffness", "f32", 1, "N/m", "of the model", "50..1e4"),
)

OWN_MODEL: Final = Layout(
    "own_model",
    "Behind the deflection of a client that simulates its own hand: the hand itself.",
    _MODEL,
)

PATCH: Final = Layout(
    "patch",
    "Surface in front of one user, free of the user's own force, and gains of the law.",
    (
        Field("tick", "u32", 1, "", "simulation tick, rising", ">= 1"),
        Field("seq", "u32", 1, "", "contact sample contained in this surface; 0 for none"),
        Field("t_server", "f64", 1, "s", "time of the tick, server's clock", "finite"),
        Field("t_client", "f64", 1, "s", "`t_client` of that sample, sent back", "finite"),
        Field("sample_wait", "f32", 1, "s", "how long that sample waited for the tick", "0..1e6"),
        Field("x_free", "f32", 3, "m", "contact point without this client's own force", _LENGTH),
        Field("normal", "f32", 3, "1", "outward unit normal there", "length 1 to 0.1 %"),
        Field(
            "curvature", "f32", 1, "1/m",
            "of the free surface round the contact; 0 for a plane", "+-1e4",
        ),
        Field(
            "c_ii", "f32", 1, "m/N",
            "compliance of the contact; K_o alone is 1 / c_ii", "1e-6..10",
        ),
        Field(
            "k_h", "f32", 1, "N/m",
            "gain that the server chose for this client's law", "0..1e6",
        ),
        Field(
            "integral_gain", "f32", 1, "N/(m s)", "I of the law `pi`; 0 for the others", "0..1e9"
        ),
        Field(
            "own_force", "f32", 3, "N",
            "on this hand, world frame, that the body carries at this tick, behind the room's lag; "
            "the body gets its opposite",
            "length <= 100",
        ),
        Field(
            "u_others", "f32", 3, "m",
            "displacement of the material under the contact by the others, world frame", _LENGTH,
        ),
        Field(
            "lag", "f32", 1, "s",
            "tau of the room (`science.md` 3.8, 3.13); 0 for none", "0..60", "room",
        ),
        Field(
            "coupling", "f16", 1, "1",
            "m of the room, the spectral radius of S", "0..1e3", "room",
        ),
        Field(
            "margin", "f16", 1, "1",
            "where forces are anticipated, 1 over the share of an error that is left after one way "
            "round; else tau over the least that is stable, 1 / m for m < 1; 6e4 for hands that do "
            "not couple",
            ">= 0", "room",
        ),
        *_ledger(),
    ),
    Frame(
        FrameKind.PATCH,
        "server to client",
        f"{_SHAPE}; bit 8: the `compliance` follows; bit 9: the `partners` follow, behind it",
        f"{_SHAPES}, others 0",
    ),
)  # fmt: skip

COMPLIANCE: Final = Layout(
    "compliance",
    "Behind a patch for a client with friction.",
    (
        Field(
            "compliance", "f32", 6, "m/N",
            "of the contact in all directions, world frame: xx yy zz xy xz yz",
            "each +-10; positive definite",
        ),
    ),
)  # fmt: skip

PARTNERS: Final = Layout(
    "partners",
    "Behind a patch and its compliance, for a client that moves models of the hands (`science.md` "
    "3.15).",
    (
        Field("count", "u16", 1, "", "partners that follow", "<= 7"),
        _reserved(2),
        Field(
            "weight", "f32", 1, "1",
            "share of the models' forces; the rest is that of the forces in this surface", "0..1",
        ),
        Field("max_force", "f32", 1, "N", "largest force of this client on the body", "0..100"),
        *_MODEL,
    ),
)  # fmt: skip

PARTNER: Final = Layout(
    "partner",
    "Another hand: its contact, what it wants, and its model. Its row of the compliance follows.",
    (
        Field("user", "u32", 1, "", "its number", ">= 1"),
        *_MODEL,
        Field(
            "intended", "f32", 1, "m",
            "depth of its tip below the surface without any force, plus its `deflection`",
            "+-20",
        ),
        Field("deflection", "f32", 1, "m", "the `deflection` that its client reports", "+-10"),
        Field(
            "force", "f32", 1, "N", "of this hand along its normal, in this surface", "0..300"
        ),
        Field("max_force", "f32", 1, "N", "largest force of this hand", "0..100"),
        Field(
            "c_jj", "f32", 1, "m/N", "compliance of its contact and its device", "1e-6..10"
        ),
    ),
)  # fmt: skip

COUPLED: Final = Layout(
    "coupled",
    "Behind a partner, for this client's contact and for each partner before it.",
    (
        Field(
            "coupled", "f32", 1, "m/N",
            "compliance between both contacts, along their normals", "+-10",
        ),
    ),
)  # fmt: skip

NEIGHBOURHOOD: Final = Layout(
    "neighbourhood",
    "Behind a mesh patch, its compliance and its partners: the free surface round the contact.",
    (
        Field(
            "count", "u16", 1, "", "neighbours that follow; the frame ends with the last", "<= 97"
        ),
        Field("scale", "f32", 1, "m", "one unit of the displacements", "0..10/32767"),
        Field("c_scale", "f32", 1, "m/N", "one unit of the compliances", "0..10/65535"),
    ),
)

NEIGHBOUR: Final = Layout(
    "neighbour",
    "One vertex of a neighbourhood.",
    (
        Field(
            "indices", "u16", 1, "", "vertex of the rest mesh",
            "more than the one before; below its vertices",
        ),
        Field("displacements", "i16", 3, "`scale`", "from the rest mesh, world frame"),
        Field("compliances", "u16", 1, "`c_scale`", "of a contact centred at the vertex"),
    ),
)  # fmt: skip

REST_MESH: Final = Layout(
    "rest_mesh",
    "Resting surface of the body, exact or quantised.",
    (
        Field("vertices", "u32", 1, "", "how many", "3..65535"),
        Field("faces", "u32", 1, "", "how many", "1..131070"),
    ),
    Frame(FrameKind.REST_MESH, "server to client", "bit 0: quantised; the `box` follows", "0, 1"),
)

VERTEX: Final = Layout(
    "vertex",
    "One vertex in the stream of an exact mesh.",
    (Field("place", "f32", 3, "m", "at rest, world frame", _LENGTH),),
)

FACE: Final = Layout(
    "face",
    "One face in the stream of an exact mesh.",
    (
        Field(
            "corners", "u16", 3, "", "numbers of vertices, counter-clockwise from outside",
            "below `vertices`",
        ),
    ),
)  # fmt: skip

BOX: Final = Layout(
    "box",
    "Behind the numbers of a quantised mesh.",
    (
        Field(
            "low", "f32", 3, "m",
            "corner of the bounding box with the smallest coordinates", "each +-10",
        ),
        Field(
            "unit", "f32", 3, "m",
            "of each axis: the length of the box over 65,535; 0 where it is flat",
            "the box ends at 10",
        ),
    ),
)  # fmt: skip

SCENE: Final = Layout(
    "scene",
    "All users at one tick, and the surface where it is asked for.",
    (
        Field("tick", "u32", 1, "", "simulation tick, rising", ">= 1"),
        Field("t_server", "f64", 1, "s", "time of the tick, server's clock", "finite"),
        Field("users", "u16", 1, "", "records that follow", "<= 256"),
        _reserved(2),
        Field("lag", "f32", 1, "s", "of the room, as in a patch", "0..60", "room"),
        Field("coupling", "f16", 1, "1", "of the room, as in a patch", "0..1e3", "room"),
        Field("margin", "f16", 1, "1", "of the room, as in a patch", ">= 0", "room"),
    ),
    Frame(
        FrameKind.SCENE,
        "server to client that watches",
        "bit 0: a surface follows the users",
        "0, 1",
    ),
)

USER: Final = Layout(
    "user",
    "One user in a scene.",
    (
        Field("user", "u32", 1, "", "its number", ">= 1"),
        Field("probe", "f32", 3, "m", "tip, world frame", _LENGTH),
        Field(
            "foot", "f32", 3, "m",
            "centre of its pressure, on the facets of the *resting* mesh", _LENGTH,
        ),
        Field(
            "force", "f32", 3, "N",
            "that the body carries, behind the room's lag, as it acts on the hand; the body gets "
            "its opposite",
            "length <= 300",
        ),
        Field(
            "c_ii", "f16", 1, "m/N",
            "compliance of the contact; 0 for one who has left, as the next three", "0..10",
        ),
        Field(
            "k_o_coupled", "f32", 1, "N/m",
            "coupling-aware, 1 / sum_j \\|C_ij\\|: the bound of the paper's laws", "0..1e6",
        ),
        Field("k_h", "f32", 1, "N/m", "as in a patch", "0..1e6"),
        Field("integral_gain", "f32", 1, "N/(m s)", "as in a patch", "0..1e9"),
        Field(
            "loop_delay", "f16", 1, "s",
            "of its loop, as measured; 0 before the first measurement", "0..1e3",
        ),
        Field(
            "normal", "i16", 3, "1/32767",
            "outward unit normal of the free surface at the contact", "length 1 to 0.1 %",
        ),
        Field("shape", "u8", 1, "", _SHAPE, _SHAPES),
        Field("presence", "u8", 1, "1/255", "share of its force that the body carries"),
        Field(
            "curvature", "f16", 1, "1/m", "of its patch, positive where the body bulges", "+-6e4"
        ),
        Field(
            "state", "u8", 1, "",
            "bit 0 `fresh`: its samples still come; bit 1 `friction`: its force may have a part "
            "along the surface",
            "0..3",
        ),
        _reserved(1),
        Field(
            "to_free", "f16", 3, "m",
            "from the tip to the contact point of the surface without this user's own force",
            _LENGTH,
        ),
        *_ledger("of the tick, as in a patch"),
    ),
)  # fmt: skip

SURFACE: Final = Layout(
    "surface",
    "Behind the users of a scene with flag bit 0: displacements of all vertices.",
    (
        Field(
            "scale", "f32", 1, "m",
            "one unit of a displacement: 1e-5, or more where that does not fit",
            "above 0, at most 0.1",
        ),
        Field(
            "length", "u32", 1, "", "of the zlib stream that follows; the frame ends with it"
        ),
    ),
)  # fmt: skip

ACK: Final = Layout(
    "ack",
    "The client has received and drawn a scene.",
    (
        Field("tick", "u32", 1, "", "of the newest scene that came", ">= 1"),
        Field(
            "wants", "u8", 1, "",
            "1: scenes with the surface until the next ack, whatever the encoding, since Green's "
            "functions are missing; 0: as the encoding says",
            "0, 1",
        ),
        _reserved(3),
    ),
    Frame(FrameKind.ACK, "client that watches to server", "0"),
)  # fmt: skip

ROWS: Final = Layout(
    "rows",
    "Rows of the client's haptic loop, while the session is recorded.",
    (
        Field("count", "u16", 1, "", "number of rows", "1..64"),
        Field(
            "lost", "u32", 1, "", "rows that were left out since the last batch, as the link was "
            "busy",
        ),
        Field("to_server", "f64", 1, "s", "the server's clock less the client's", "+-1e9"),
        Field("error", "f64", 1, "s", "bound on its error", ">= 0"),
        Field("round_trip", "f32", 1, "s", "mean round trip", ">= 0"),
        Field("jitter", "f32", 1, "s", "mean deviation from it", ">= 0"),
    ),
    Frame(FrameKind.ROWS, "client to server", "0"),
)  # fmt: skip

LAYOUTS: Final = (
    CONTACT_SAMPLE, ANCHOR, DEFLECTION, OWN_MODEL,
    PATCH, COMPLIANCE, PARTNERS, PARTNER, COUPLED, NEIGHBOURHOOD, NEIGHBOUR,
    REST_MESH, VERTEX, FACE, BOX,
    SCENE, USER, SURFACE,
    ACK, ROWS,
)  # fmt: skip
