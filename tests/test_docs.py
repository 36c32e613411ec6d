"""What is written twice, in prose and in code, must agree."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from cohaptic.errors import CloseCode
from cohaptic.protocol import (
    frame,
    messages,
    neighbourhood,
    rest_mesh,
    scene_users,
    traversal,
    upload_messages,
    watch_messages,
)
from cohaptic.protocol.control.message import ControlMessage, SetName
from cohaptic.protocol.version import PROTOCOL_VERSION, SUBPROTOCOL
from tests.shared.protocol.control import SOCIAL

ROOT = Path(__file__).parents[1]
PROTOCOL = (ROOT / "docs/protocol.md").read_text()
PACKAGES = (
    "shared/cohaptic",
    "server/cohaptic_server",
    "server/cohaptic_ops",
    "server/cohaptic_tools",
    "server/cohaptic_uploads",
    "client/cohaptic_client",
    "client/cohaptic_drivers",
    "experiments/cohaptic_experiments",
)


def section(heading: str) -> str:
    """A part of the protocol's page, from its heading to the next one."""
    start = PROTOCOL.index(f"# {heading}")
    return PROTOCOL[start : PROTOCOL.find("\n#", start)]


def test_the_version_is_the_codes() -> None:
    assert PROTOCOL.startswith(f"# Protocol, version {PROTOCOL_VERSION}\n")
    assert f"`{SUBPROTOCOL}`" in PROTOCOL


def test_the_limits_of_parts_are_the_codes() -> None:
    assert f"| <= {neighbourhood.MAX_VERTICES} |" in section("neighbourhood")
    assert f"at most {neighbourhood.MAX_VERTICES}," in section("neighbourhood")
    assert f"{rest_mesh.MAX_VERTICES:,} vertices or {rest_mesh.MAX_FACES:,} faces" in PROTOCOL
    assert f"3..{rest_mesh.MAX_VERTICES} |" in section("rest_mesh")
    assert f"1..{rest_mesh.MAX_FACES} |" in section("rest_mesh")
    assert f"| <= {scene_users.MAX_USERS} |" in section("scene, ")
    assert all(field.name in section("scene, ") for field in fields(traversal.Traversal))


def test_the_limits_of_frames_are_the_codes() -> None:
    assert f"at most {frame.MAX_FRAME_BYTES} bytes" in PROTOCOL
    assert f"a mesh\npatch of at most {frame.MAX_MESH_FRAME_BYTES:,}" in PROTOCOL
    assert f"`watching` {watch_messages.MAX_WATCHING_TEXT:,}" in PROTOCOL


@pytest.mark.parametrize(
    ("title", "message"),
    [
        ("hello,", messages.Hello),
        ("set_name,", SetName),
        ("bye,", messages.Bye),
        ("welcome,", messages.Welcome),
        ("user_joined,", messages.UserJoined),
        ("user_left,", messages.UserLeft),
        ("restraints,", messages.Restraints),
        ("recorded,", messages.Recorded),
        ("mark,", messages.Mark),
        ("error,", messages.Error),
        ("watch,", watch_messages.Watch),
        ("set_view,", watch_messages.SetView),
        ("set_latency,", watch_messages.SetLatency),
        ("moderate,", watch_messages.Moderate),
        *SOCIAL,
        ("upload_offer,", upload_messages.UploadOffer),
        ("begin_upload,", upload_messages.BeginUpload),
        ("examined,", upload_messages.Examined),
        ("prepare_object,", upload_messages.PrepareObject),
        ("progress,", upload_messages.Progress),
        ("prepared,", upload_messages.Prepared),
    ],
)
def test_every_field_of_a_control_message_is_described(
    title: str, message: type[ControlMessage]
) -> None:
    described = re.findall(r"^\| `(\w+)` \|", section(title), re.M)
    assert described == list(message.model_fields)


def test_every_close_code_is_described() -> None:
    for code in CloseCode:
        assert f"| {code.value} | {code.name} |" in PROTOCOL


def test_the_architecture_page_names_modules_as_they_are_and_every_folder() -> None:
    page = (ROOT / "docs/architecture.md").read_text()
    sources = {name.rsplit("/", 1)[-1]: ROOT / name for name in PACKAGES}
    for named in re.findall(r"`(cohaptic\w*/[\w/]+\.py)`", page):
        package, _, inside = named.partition("/")
        assert (sources[package] / inside).is_file(), named
    for package, root in sources.items():
        if package == "cohaptic_experiments":
            continue
        (line,) = re.findall(rf"^{package} +(.*>.*)$", page, re.M)
        folders = {path.parent.name for path in root.glob("*/__init__.py")}
        assert folders <= set(re.findall(r"\w+", line)), package


def test_every_package_says_first_what_it_is() -> None:
    for name in PACKAGES:
        for init in (ROOT / name).rglob("__init__.py"):
            assert init.read_text().startswith('"""'), init


def test_every_file_that_a_page_points_to_exists() -> None:
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")):
        for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_page_is_in_the_navigation_of_the_site() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text().partition("\nnav:")[2]
    listed = re.findall(r"([\w./-]+\.md)$", navigation, re.M)
    pages = {p.relative_to(ROOT / "docs").as_posix() for p in (ROOT / "docs").rglob("*.md")}
    assert sorted(listed) == sorted(pages)


NAMED_TESTS = re.compile(r"`((?:tests/[\w/]+/)?test_\w+\.py)?(?:::)?(test_\w+)?`")


def test_the_tests_that_pages_name_exist() -> None:
    """As `tests/FOLDERS/test_FILE.py`, `test_FILE.py`, `test_NAME`, or a file and a name in it."""
    tests = {path: path.read_text() for path in (ROOT / "tests").rglob("test_*.py")}
    for page in (ROOT / "docs").rglob("*.md"):
        for file, name in NAMED_TESTS.findall(page.read_text()):
            paths = [p for p in tests if not file or p.as_posix().endswith(f"/{file}")]
            assert paths, f"{page.name}: {file}"
            found = not name or any(f"def {name}(" in tests[p] for p in paths)
            assert found, f"{page.name}: {name}"


def test_every_hazard_of_the_hand_has_a_guard_and_a_test() -> None:
    page = (ROOT / "docs/safety.md").read_text()
    for title in ("Hazards", "Drivers under attack"):
        table = page.partition(f"## {title}\n")[2].partition("\n## ")[0]
        rows = [line.strip("|").split("|") for line in table.splitlines() if line.startswith("| ")]
        assert len(rows) > 6, title
        for row in rows[2:]:  # below the heads and the rule
            assert all(cell.strip() for cell in row), row
            files = [file for file, _ in NAMED_TESTS.findall(row[-1])]
            assert any(files), row
            if title == "Drivers under attack":
                text = "\n".join((ROOT / file).read_text() for file in files)
                for _, name in NAMED_TESTS.findall("|".join(row[:-1])):
                    assert f"def {name}(" in text, (row[0], name)


def test_the_threat_model_names_files_that_exist() -> None:
    page = (ROOT / "docs/threat-model.md").read_text()
    homes = {name.rsplit("/", 1)[-1]: ROOT / name for name in PACKAGES}
    for package, inside in re.findall(r"`(cohaptic\w*)/([\w/]+(?:\.py)?)`", page):
        assert (homes[package] / inside).exists(), inside


def test_the_code_points_to_pages_that_exist() -> None:
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for target in re.findall(r"docs/[\w/-]+(?:\.md)?", path.read_text()):
                matches = list(ROOT.glob(target + ("*" if not target.endswith(".md") else "")))
                assert matches, f"{path.name}: {target}"
