"""Session files as other people's programs read them: MCAP, JSON Schema, protobuf, Foxglove."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema

from cohaptic.protocol.quantised_mesh import QuantisedMesh
from cohaptic.protocol.scene_users import decode_users
from cohaptic.sessions.entries import Mesh, Patched, Rows, Shown
from cohaptic.sessions.plots import MAX_VERTICES, Plotter
from cohaptic.status.row import COLUMNS
from tests.shared.sessions.made import TETRAHEDRON, T, info, rows, scene, session, write

LAYOUT = Path(__file__).parents[3] / "docs" / "how-to" / "foxglove-layout.json"


@pytest.fixture(scope="module")
def messages(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Schema, Channel, Message]]:
    path = write(tmp_path_factory.mktemp("tools") / "x.mcap", session())
    with path.open("rb") as file:
        found = list(make_reader(file, validate_crcs=True).iter_messages())
    assert all(schema is not None for schema, _, _ in found)
    return [(schema, channel, message) for schema, channel, message in found if schema]


def on(messages: list[tuple[Schema, Channel, Message]], topic: str) -> list[Message]:
    return [message for _, channel, message in messages if channel.topic == topic]


def test_every_json_message_is_as_its_schema_in_the_file_says(
    messages: list[tuple[Schema, Channel, Message]],
) -> None:
    seen = set[str]()
    for schema, channel, message in messages:
        if channel.message_encoding == "json":
            assert schema.encoding == "jsonschema"
            validator = jsonschema_rs.Draft202012Validator(json.loads(schema.data))
            validator.validate(json.loads(message.data))
            seen.add(schema.name)
    assert {"cohaptic.Mark", "cohaptic.Joined", "cohaptic.Plot"} < seen
    assert {"foxglove.SceneUpdate", "foxglove.FrameTransform", "foxglove.Log"} < seen


def test_every_protobuf_message_is_read_by_its_description_in_the_file(
    messages: list[tuple[Schema, Channel, Message]],
) -> None:
    classes = dict[str, Any]()
    counts = dict[str, int]()
    for schema, channel, message in messages:
        if channel.message_encoding != "protobuf":
            continue
        if schema.name not in classes:
            pool = descriptor_pool.DescriptorPool()
            for described in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                pool.Add(described)
            classes[schema.name] = message_factory.GetMessageClass(
                pool.FindMessageTypeByName(schema.name)
            )
        read = classes[schema.name].FromString(message.data)
        counts[schema.name] = counts.get(schema.name, 0) + 1
        if schema.name == "cohaptic.Rows":
            check_rows(read)
        if schema.name == "cohaptic.Shown":
            users = decode_users(read.frame).users
            assert [record.force for record in users] == [(0.0, 0.0, -1.0)] * 2
    written = session()
    assert counts["cohaptic.Rows"] == sum(isinstance(entry, Rows) for entry in written)
    assert counts["cohaptic.Patched"] == sum(isinstance(entry, Patched) for entry in written)


def check_rows(read: Any) -> None:
    """Numbers stand column after column, as the comment of the table says."""
    made = rows(read.t, 50, read.user)
    table = np.frombuffer(made.block).reshape(50, -1)
    names = read.columns.split("\n")
    exact = read.exact_columns.split("\n")
    assert names == list(COLUMNS)
    others = [name for name in names if name not in exact]
    for part, columns in ((read.exact, exact), (read.values, others)):
        numbers = np.array(part).reshape(len(columns), 50)
        for name, column in zip(columns, numbers, strict=True):
            assert column == pytest.approx(table[:, names.index(name)], rel=6e-8), name


def test_messages_have_the_time_of_day(messages: list[tuple[Schema, Channel, Message]]) -> None:
    [mark, pause] = on(messages, "/marks")
    assert mark.log_time == pause.log_time == (1_800_000_000 + 103) * 10**9


def test_plots_come_60_times_a_second_for_each_user(
    messages: list[tuple[Schema, Channel, Message]],
) -> None:
    for user in (1, 2):
        found = on(messages, f"/user/{user}/plot")
        assert len(found) == pytest.approx(60 * 2.75, abs=2)
        steps = np.diff([message.log_time for message in found]) / 1e9
        assert steps == pytest.approx(np.full(len(steps), 1 / 60), abs=1.1e-3)
        first = json.loads(found[0].data)
        assert first["t"] == pytest.approx(T)
        assert first["tip"]["x"] == pytest.approx(0.1 * user)
        assert (first["newtons"], first["force"]["z"]) == (3.0, 3.0)
        assert first["rules"]["surface"] == 3.0


def test_hands_are_drawn_30_times_a_second_at_most_with_arrows_along_their_forces(
    messages: list[tuple[Schema, Channel, Message]],
) -> None:
    found = on(messages, "/hands")
    assert 30 <= len(found) <= 90
    for entity in json.loads(found[5].data)["entities"]:
        [arrow] = entity["arrows"]
        turn = arrow["pose"]["orientation"]
        assert turned_x_axis(turn) == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)
        assert arrow["shaft_length"] + arrow["head_length"] == pytest.approx(0.02)


def turned_x_axis(q: dict[str, float]) -> list[float]:
    """The x axis after a rotation by a unit quaternion."""
    x, y, z, w = q["x"], q["y"], q["z"], q["w"]
    assert x * x + y * y + z * z + w * w == pytest.approx(1.0)
    return [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)]


@pytest.mark.parametrize(
    "force", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 1e-7, 0), (0.3, -0.4, 0.5)]
)
def test_an_arrow_points_along_any_force(force: tuple[float, float, float]) -> None:
    [drawn] = Plotter(info()).of(Shown(T, 1, scene(T, 1, {1: force})))
    [entity] = json.loads(drawn.data)["entities"]
    way = turned_x_axis(entity["arrows"][0]["pose"]["orientation"])
    assert way == pytest.approx(list(np.array(force) / np.linalg.norm(force)), abs=1e-6)


def test_the_surface_is_drawn_in_both_forms_and_left_out_if_it_is_too_fine() -> None:
    quantised = QuantisedMesh.of(
        np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], float),
        np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    ).encode()
    for frame in (TETRAHEDRON, quantised):
        [drawn] = Plotter(info()).of(Mesh(T, frame))
        [entity] = json.loads(drawn.data)["entities"]
        [triangles] = entity["triangles"]
        assert len(triangles["points"]) == 4
        assert triangles["points"][3] == pytest.approx({"x": 0.0, "y": 0.0, "z": 0.1}, abs=1e-5)
        assert len(triangles["indices"]) == 12
    assert not Plotter(info()).of(Mesh(T, b"another frame"))
    n = MAX_VERTICES + 1
    around = np.arange(n)
    places = np.column_stack([np.cos(around), np.sin(around), around / n])
    faces = np.column_stack([around[:-2], around[1:-1], around[2:]])
    assert not Plotter(info()).of(Mesh(T, QuantisedMesh.of(places, faces).encode()))


def test_numbers_that_json_does_not_know_are_null_in_a_plot() -> None:
    made = rows(T, 2)
    table = np.frombuffer(made.block).reshape(2, -1).copy()
    table[:, COLUMNS.index("by_gain")] = np.nan
    table[:, COLUMNS.index("fz")] = -np.inf
    [drawn] = Plotter(info()).of(Rows(T, 1, COLUMNS, table.tobytes(), made.to_server, 0.0))
    found = json.loads(drawn.data)
    assert (found["rules"]["gain"], found["force"]["z"], found["newtons"]) == (None, None, None)


def test_a_rule_with_a_strange_name_is_plotted() -> None:
    columns = (*COLUMNS[:-4], 'by_50% "x":inf', *COLUMNS[-3:])
    [drawn] = Plotter(info()).of(rows(T, 1, columns=columns))
    assert json.loads(drawn.data)["rules"]['50% "x":inf'] == 0.0


def test_the_layout_shows_topics_and_fields_that_a_file_has(
    messages: list[tuple[Schema, Channel, Message]],
) -> None:
    layout = json.loads(LAYOUT.read_text())
    by_topic = {channel.topic: json.loads(message.data) for _, channel, message in messages
                if channel.message_encoding == "json"}  # fmt: skip
    paths = set(re.findall(r'"value": "(/[^"]+)"', json.dumps(layout)))
    assert len(paths) > 20
    for path in paths:
        topic, *fields = re.sub(r"/user/\d+/", "/user/1/", path).split(".")
        value = by_topic[topic]
        for name in fields:
            value = value[name]
        assert isinstance(value, float | int), path
    shown = json.dumps(layout)
    for topic in ("/hands", "/object", "/log", "/marks"):
        assert f'"{topic}"' in shown
        assert topic in by_topic
    panels = set(re.findall(r'"(\w+![a-z0-9]+)"', json.dumps(layout["layout"])))
    assert panels == set(layout["configById"])
