"""The client in C++ (`clients/cpp`): frames, laws and loop by the golden vectors, and rubbish.

`vectors.cpp` answers questions line by line, so the vectors are read here and hands simulated here.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import random
import re
import struct
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from cohaptic.control.law import Law
from cohaptic.errors import ProtocolError
from cohaptic.protocol.messages import Hello, Welcome, decode_client_control
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.protocol.websocket_frames import BINARY, TEXT, make_frame
from cohaptic.simulated.hand import Hand, HandState, move
from cohaptic.vec import ZERO, Vec3, scale
from tests.client.loop.plays import PATCH_FIELDS, PLAYS, path
from tests.clients_cpp.programs import (
    COMPILERS,
    SANITISED,
    SOURCES,
    Questions,
    build,
    compiler,
    sanitising,
)
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

VECTORS = Path(__file__).parents[1] / "vectors"
CLOSE = 1e-6  # of a value, for other mathematical libraries: with one and the same nothing differs
ROUND = 1e-9  # m, N, J, s, where a value is near zero
PERIOD = 0.001  # s
# Plays of the predictive law alone.
PREDICTIVE = [p.name for p in PLAYS if {law for _, law in p.laws} == {Law.PREDICTIVE}]


def written(name: str) -> Any:
    return json.loads((VECTORS / f"{name}.json").read_text())


def close(expected: object) -> Any:
    return pytest.approx(expected, rel=CLOSE, abs=ROUND)


def surface_words(surface: dict[str, Any]) -> list[object]:
    names = ("x_free", "normal", "curvature", "c_ii", "own_force", "u_others")
    return [surface[name] for name in names]


def sight_words(sight: dict[str, Any]) -> list[object]:
    return [sight[name] for name in ("depth", "normal", "c_ii", "own_force", "u_others")]


def flat(values: Iterable[Any]) -> list[float]:
    found = list[float]()
    for value in values:
        found += [float(value)] if isinstance(value, float | int) else flat(value)
    return found


@pytest.mark.parametrize("source", ["press.cpp", "tests/vectors.cpp"])
@pytest.mark.parametrize("name", COMPILERS)
def test_each_program_compiles_without_a_warning(name: str, source: str, tmp_path: Path) -> None:
    build(compiler(name), source, tmp_path / "program", "-Wconversion", "-Wshadow")


def test_the_lines_of_the_how_to_compile(tmp_path: Path) -> None:
    page = (SOURCES.parents[1] / "docs/how-to/join-from-another-language.md").read_text()
    (lines,) = re.findall(r"^```cpp\n(.*?)^```", page, re.S | re.M)
    device = (
        "struct Device { bool wait_for_the_next_millisecond(); void write(cohaptic::Vec3); "
        "cohaptic::Vec3 position(), velocity(); };\n"
    )
    source = tmp_path / "touch.cpp"
    source.write_text(lines.replace('"cohaptic.hpp"\n', f'"cohaptic.hpp"\n{device}'))
    build(compiler("g++"), str(source), tmp_path / "touch.o", "-c", f"-I{SOURCES}")


def test_samples_are_the_written_bytes(vectors: Questions) -> None:
    plain = [v for v in written("contact_sample") if v["fields"]["deflection"] is None]
    plain = [v for v in plain if v["fields"]["anchor"] is None]
    assert len(plain) >= 2
    for vector in plain:
        f = vector["fields"]
        values = (f["seq"], f["tick"], f["t_client"], f["probe"], f["force"])
        assert vectors.ask("sample", *values) == vector["hex"], vector["name"]


def test_a_sample_beyond_its_limits_is_refused(vectors: Questions) -> None:
    answer = vectors.ask("sample", 1, 0, 0.0, (0.0, 11.0, 0.0), ZERO)
    assert answer == "error length of probe is 11 m; expected at most 10 m"
    answer = vectors.ask("sample", 1, 0, 0.0, ZERO, (0.0, math.nan, 0.0))
    assert answer == "error length of force is nan N; expected at most 100 N"
    assert vectors.ask("sample", 0, 0, 0.0, ZERO, ZERO).startswith("error seq is 0;")


def decoded(frame: bytes) -> list[float]:
    """Numbers of the patch in a frame, in the order of `vectors patch`."""
    p = Patch.decode(frame)
    return flat(
        [p.tick, p.seq, p.t_server, p.t_client, p.sample_wait, p.x_free, p.normal, p.curvature,
         p.c_ii, p.k_h, p.own_force, p.u_others, p.room.lag]
    )  # fmt: skip


def test_patches_of_planes_and_spheres_are_understood_and_others_refused(
    vectors: Questions,
) -> None:
    taken = 0
    for vector in written("patch"):
        frame = bytes.fromhex(vector["hex"])
        for law in (None, 3):  # as it is, and made one of the predictive law
            if law is not None:
                frame = frame[:2] + bytes([frame[2] & 0x0F | law << 4]) + frame[3:]
            ours = frame[2] in (0x31, 0x32) and frame[3] == 0
            if ours:
                assert vectors.numbers("patch", frame.hex()) == decoded(frame), vector["name"]
                taken += 1
            else:
                with pytest.raises(ValueError, match="of a patch is"):
                    vectors.numbers("patch", frame.hex())
    assert taken >= 2


def test_the_cpp_reader_refuses_what_pythons_refuses(vectors: Questions) -> None:
    """Random damage to a patch: both take it with the same numbers, or neither does."""
    rng = random.Random(4)
    whole = Patch(
        tick=7, seq=3, t_server=2.0, t_client=1.0, sample_wait=0.002, geometry=Geometry.SPHERE,
        law=Law.PREDICTIVE, x_free=(0.1, 0.0, 0.0), normal=(1.0, 0.0, 0.0), curvature=10.0,
        c_ii=0.004, k_h=250.0, integral_gain=0.0, own_force=ZERO, u_others=ZERO,
    ).encode()  # fmt: skip
    refused = 0
    for _ in range(3000):
        frame = bytearray(whole)
        for _ in range(rng.randrange(1, 4)):
            frame[rng.randrange(len(frame))] = rng.randrange(256)
        damaged = bytes(frame[: rng.randrange(len(frame))] if rng.random() < 0.1 else frame)
        answer = vectors.ask("patch", damaged.hex())
        try:
            expected = decoded(damaged)
        except ProtocolError:
            assert answer.startswith("error "), damaged.hex()
            refused += 1
            continue
        if damaged[2] in (0x31, 0x32) and damaged[3] == 0:
            got = [float(word) for word in answer.split()]
            assert got == expected, damaged.hex()
        else:
            assert answer.startswith("error "), damaged.hex()
    assert refused > 300


def test_surfaces_are_seen_and_blended_as_written(vectors: Questions) -> None:
    for row in written("law")["surfaces"]:
        seen = vectors.numbers("look", surface_words(row["surface"]), row["probe"])
        assert seen == close(flat(sight_words(row["sight"])))
        pair = sight_words(row["sight"]) + sight_words(row["other"])
        between = vectors.numbers("blend", pair, row["share"])
        assert between == close(flat(sight_words(row["blend"])))
        assert vectors.numbers("shift", pair) == close(flat(sight_words(row["shift"])))


def test_the_predictive_law_presses_as_written(vectors: Questions) -> None:
    plays = [play for play in written("law")["presses"] if play["law"] == "predictive"]
    assert plays
    for play in plays:
        for step in play["steps"]:
            (force,) = vectors.numbers("law", step["sight"]["depth"], play["gains"]["k_h"])
            assert force == close(step["force"]["normal_force"])


def test_samples_leave_when_the_written_ones_do(vectors: Questions) -> None:
    vectors.ask("pacer", 0.016, 10.0)
    for row in written("link"):
        (due,) = vectors.numbers("report", row["t_client"], row["sample_wait"], row["now"])
        assert due == close(row["due"])


def test_the_guard_gives_the_written_forces(vectors: Questions) -> None:
    for row in written("safety"):
        wanted = [math.nan if x is None else x for x in row["wanted"]]
        answer = vectors.ask("guard", row["now"], wanted, row["velocity"], row["silent"])
        *numbers, fault = answer.split(" ", 6)
        force, (share, left, engaged) = numbers[:3], numbers[3:6]
        assert [float(x) for x in force] == close(row["force"]), row["now"]
        assert (float(share), float(left)) == close((row["scale"], row["left"]))
        assert float(engaged) == row["engaged"]
        assert bool(fault) == bool(row["fault"])


@pytest.mark.parametrize("name", PREDICTIVE)
def test_a_whole_loop_gives_the_written_forces(vectors: Questions, name: str) -> None:
    (play,) = [play for play in written("step") if play["name"] == name]
    limits = play["limits"]
    vectors.ask(
        "loop", play["simulation_period"], play["max_stiffness"], play["max_damping"],
        limits["engage_time"], limits["stall"], False, limits["max_rate"],
        limits["max_force"],
    )  # fmt: skip
    rows = {row["i"]: row for row in play["rows"]}
    way = tuple((t, d) for t, d in play["way"])
    hand, normal = Hand(**play["hand"]), as_vec(play["normal"])
    coming = list(play["patches"])
    tip, force, compared = HandState(scale(normal, 0.1 - path(way, 0.0)), ZERO), ZERO, 0
    for i in range(1500):
        now = round(i * PERIOD, 6)
        tip = move(tip, hand, scale(normal, 0.1 - path(way, now)), force, PERIOD)
        if i in play["left_out"]:
            continue
        while coming and coming[0]["at"] <= now:
            patch = coming.pop(0) | {"normal": normal, "curvature": play["curvature"]}
            assert patch.keys() >= set(PATCH_FIELDS)
            more = (patch["tick"], patch["t_server"], patch["k_h"])
            assert vectors.ask("give", now, surface_words(patch), *more) == ""
        seen = vectors.numbers("step", tip.position, tip.velocity, now)
        force = as_vec(seen[:3])
        if i in rows:
            assert seen == close(expected_of(rows[i])), (name, now)
            compared += 1
    assert compared == len(rows) > 50


def as_vec(values: list[float]) -> Vec3:
    x, y, z = values
    return (x, y, z)


def expected_of(row: dict[str, Any]) -> list[float]:
    """What a period's answer has to be, in its order."""
    depth = -math.inf if row["depth"] is None else row["depth"]
    names = ("k_h", "patience", "behind", "owed", "stored", "scale", "left", "engaged", "silent")
    return flat([row["force"], row["on_body"], depth, *(float(row[name]) for name in names)])


def test_the_hello_is_one_that_the_server_reads(vectors: Questions) -> None:
    hello = decode_client_control(vectors.ask("hello", 2.5, "0123456789abcdef", 'a "\u00e9"\\'))
    assert isinstance(hello, Hello)
    assert (hello.name, hello.key, hello.law) == (
        'a "\u00e9"\\',
        "0123456789abcdef",
        Law.PREDICTIVE,
    )
    assert (hello.max_stiffness, hello.max_force, hello.damping_budget) == (1000.0, 10.0, 2.5)
    assert (hello.geometry, hello.friction, hello.models) == ("plane", False, False)
    assert hello.rules is not None
    assert hello.rules.lacking == ("models", "compliance", "friction", "trust")
    assert vectors.ask("hello", 9.0, "0123456789abcdef", "a") == (
        "error max_damping is 9; expected from 0 to 8"
    )


def test_every_written_control_message_is_read_as_python_reads_it(vectors: Questions) -> None:
    for vector in written("control"):
        got = json.loads(vectors.ask("json", vector["text"]))
        assert got == json.loads(vector["text"]), vector["name"]
    texts = [v["text"] for v in written("control") if v["name"].startswith("welcome")]
    for text in texts:
        welcome = Welcome.model_validate_json(text)
        *numbers, names = vectors.ask("welcome", text).split(" ", 6)
        body = welcome.body
        expected = [welcome.user, welcome.simulation_period, body.center, body.radius]
        assert [float(word) for word in numbers] == flat(expected)
        assert names == f"{welcome.name}/{body.name}"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 9 + "]" * 9, "depth of JSON is 9; expected at most 8"),
        ("[" + "0," * 8192 + "0]", "values in JSON is 8193; expected at most 8192"),
        ('{"a":1,"a":2}', "JSON at character 10 is a name for the second time;"),
        ('"' + "x" * 65536 + '"', "bytes of a control message is 65538; expected from 2 to 65536"),
        ("1e400", "JSON at character 5 is a number that no double holds;"),
        ("[01]", "JSON at character 2 is a list without an end;"),
        ("NaN", "JSON at character 0 is no value;"),
        ('"\\ud800"', "JSON at character 7 is half a pair of surrogates;"),
    ],
)
def test_json_beyond_the_limits_is_refused_by_value_and_limit(
    vectors: Questions, text: str, words: str
) -> None:
    assert vectors.ask("json", text).startswith(f"error {words}")


@pytest.mark.parametrize("field", ["simulation_period", "protocol", "body"])
def test_a_welcome_that_lacks_a_field_is_refused(vectors: Questions, field: str) -> None:
    text = next(v["text"] for v in written("control") if v["name"] == "welcome")
    whole = json.loads(text)
    answer = vectors.ask("welcome", json.dumps({k: v for k, v in whole.items() if k != field}))
    assert answer == f"error field '{field}' is not there; expected one"
    answer = vectors.ask("welcome", json.dumps(whole | {"simulation_period": 1e-6}))
    assert answer == "error simulation_period is 1e-06; expected from 0.005 to 0.1"


def test_websocket_frames_are_cut_and_masked_as_python_does(vectors: Questions) -> None:
    rng = random.Random(9)
    messages = [rng.randbytes(n) for n in (0, 1, 125, 126, 140, 1536)]
    stream = b"".join(make_frame(data) for data in messages) + make_frame("\u00e9" * 300)
    pieces = [stream[i : i + 97].hex() for i in range(0, len(stream), 97)]
    kinds = [(BINARY & 0x0F, data) for data in messages]
    kinds.append((TEXT & 0x0F, ("\u00e9" * 300).encode()))
    expected = "".join(f"{kind} {data.hex()} " for kind, data in kinds)
    assert vectors.ask("frames", *pieces) == expected
    for data in messages:
        key = rng.randrange(2**32)
        masked = vectors.ask("mask", key, data.hex())
        assert masked == make_frame(data, struct.pack("<I", key)).hex()


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (b"\x82\x80\x00\x00\x00\x00", "frame of the server is masked; expected not masked"),
        (b"\x02\x00", "frame is a fragment; expected a whole message"),
        (b"\xc2\x00", "reserved bits of a frame is 4; expected 0"),
        (b"\x83\x00", "opcode of a frame is 3; expected 1, 2, 8, 9 or 10"),
        (b"\x89\x7e\x00\x7e", "bytes of a frame is 126; expected from 0 to 125"),
        (b"\x82\x7e\xff\xff", "bytes of a frame is 65535; expected from 0 to 1536"),
        (b"\x81\x7f" + b"\xff" * 8, "bytes of a frame is 1.84467e+19; expected from 0 to 65536"),
    ],
)
def test_a_frame_that_is_not_allowed_is_refused(
    vectors: Questions, frame: bytes, words: str
) -> None:
    assert vectors.ask("frames", frame.hex()) == f"error {words}"


def test_the_handshake_is_checked_as_rfc_6455_says(vectors: Questions) -> None:
    for size in (0, 3, 55, 56, 64, 200):
        key = "x" * size + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
        digest = hashlib.sha1(key.encode()).digest()
        assert vectors.ask("accept", key) == base64.b64encode(digest).decode()


@pytest.mark.parametrize(
    ("url", "answer"),
    [
        ("ws://127.0.0.1:8765", "127.0.0.1 8765 /"),
        ("ws://[::1]:8765/r/liver", "::1 8765 /r/liver"),
        ("ws://lab/haptics/r/liver/", "lab 80 /haptics/r/liver/"),
    ],
)
def test_an_address_is_host_port_and_path(vectors: Questions, url: str, answer: str) -> None:
    assert vectors.ask("address", url) == answer


@pytest.mark.parametrize("url", ["wss://lab:1", "http://lab", "ws://", "ws://lab:x", "ws://a/#t"])
def test_another_address_is_refused_with_its_reason(vectors: Questions, url: str) -> None:
    answer = vectors.ask("address", url)
    assert answer.startswith(f"error address is '{url}'; it must be ")
    assert ("no TLS" in answer) == url.startswith("wss:")


def test_no_rubbish_crashes_a_reader_or_reaches_the_hand(tmp_path: Path) -> None:
    """Under the address sanitiser: damaged patches, texts and streams, and a hand in the object."""
    program = build(sanitising(), "tests/vectors.cpp", tmp_path / "vectors", *SANITISED)
    for seed in range(3):
        done = subprocess.run(
            [program, "rubbish", str(seed), "8000"],
            capture_output=True, text=True, timeout=5 * PATIENCE, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        taken, refused, largest = (float(word) for word in done.stdout.split())
        assert min(taken, refused) > 1000
        assert largest > 0.5  # there was a force that the rubbish could have changed
