from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cohaptic.control.law import Law
from cohaptic_ops.rooms.config import PREFIX, ObjectTable, RoomsConfig, RoomTable, load_config
from cohaptic_ops.rooms.config_errors import ConfigError
from cohaptic_ops.rooms_cli import object_options
from cohaptic_server.guard.limits import Limits
from cohaptic_server.objects.object_file import ObjectFile
from cohaptic_server.settings import ServerSettings
from tests.server.objects.given_options import GIVEN

TWO = """
port = 0
allow_hosts = ["lab.example"]
[limits]
open = 500
[rooms.main]
body = "balloon"
[rooms.liver]
body = "liver.stl"
title = "A liver"
laws = ["predictive"]
rate = 100
max_users = 4
[rooms.liver.object]
young = ["3e3", "tumour=60e3"]
poisson = 0.45
fix = "z < 10%"
[rooms.liver.limits]
samples = "3:12"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "rooms.toml"
    path.write_text(text)
    (folder / "liver.stl").touch()
    return path


def problems(folder: Path, text: str) -> list[str]:
    with pytest.raises(ConfigError) as error:
        load_config(written(folder, text))
    return list(error.value.problems)


def test_rooms_have_each_their_body_law_limits_rate_and_capacity(tmp_path: Path) -> None:
    config = load_config(written(tmp_path, TWO))
    assert list(config.rooms) == ["main", "liver"]
    main, liver = config.settings_of("main"), config.settings_of("liver")
    made = {"body": "balloon", "nonlinear": False, "relaxation": 0.0, "users": None}
    made_from = {**made, "auto": False, "object": {}}
    hosts = ("lab.example",)
    assert main == ServerSettings(port=0, allow_hosts=hosts, room="main", made_from=made_from)
    assert liver.made_from["object"]["young"] == ["3e3", "tumour=60e3"]
    assert (liver.room, liver.simulation_hz, liver.max_users) == ("liver", 100.0, 4)
    assert liver.laws == (Law.PREDICTIVE,)
    assert liver.limits == Limits().changed(["samples=3:12"])
    assert config.router.limits == Limits().changed(["open=500"])
    # A file is looked for beside the configuration.
    assert config.rooms["liver"].body == str(tmp_path / "liver.stl")
    assert dict(config.rooms["liver"].object)["young"] == ["3e3", "tumour=60e3"]


def test_the_environment_goes_before_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in {
        "PORT": "8080",
        "ROOMS__LIVER__MAX_USERS": "7",
        "ROOMS__LIVER__OBJECT__EDGE": "0.1",
        "ROOMS__LIVER__LIMITS__OPEN": "9",
        "ALLOW_ORIGINS": '["https://lab.example"]',
    }.items():
        monkeypatch.setenv(PREFIX + name, value)
    config = load_config(written(tmp_path, TWO))
    assert (config.port, config.allow_origins) == (8080, ("https://lab.example",))
    liver = config.rooms["liver"]
    assert (liver.max_users, dict(liver.object)["edge"], liver.title) == (7, 0.1, "A liver")
    assert config.settings_of("liver").limits == Limits().changed(["samples=3:12", "open=9"])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_file_is_read_as_an_editor_of_another_system_has_saved_it(
    encoding: str, tmp_path: Path
) -> None:
    path = written(tmp_path, TWO)
    path.write_bytes(TWO.replace("\n", "\r\n").encode(encoding))
    saved = load_config(path).model_dump()
    assert saved == load_config(written(tmp_path, TWO)).model_dump()


def test_what_an_orchestrator_tells_of_a_service_of_our_name_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", logger="cohaptic.server")
    set_before = {
        "SERVICE_HOST": "10.0.0.1",
        "SERVICE_PORT": "8765",
        "SERVICE_PORT_HTTP": "8765",
        "PORT": "tcp://10.0.0.1:8765",
        "PORT_8765_TCP": "tcp://10.0.0.1:8765",
        "PORT_8765_TCP_PROTO": "tcp",
        "PORT_8765_TCP_PORT": "8765",
        "PORT_8765_TCP_ADDR": "10.0.0.1",
    }
    for name, value in set_before.items():
        monkeypatch.setenv(PREFIX + name, value)
    assert load_config(written(tmp_path, TWO)).port == 0
    (line,) = caplog.messages
    assert all(PREFIX + name in line for name in set_before)
    # Nothing else that is wrong is taken for theirs.
    for name, value in (("PORT", "8765/tcp"), ("PORT_X", "1"), ("SERVICE", "1")):
        monkeypatch.setenv(PREFIX + name, value)
        with pytest.raises(ConfigError, match=PREFIX + name):
            load_config(written(tmp_path, TWO))
        monkeypatch.delenv(PREFIX + name)


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("port = 70000", "port is 70000; it must be less than or equal to 65535"),
        ('port = "x"', "port is 'x'; it must be a valid integer"),
        ("prot = 1", "prot is no key that is known"),
        ("[rooms.main]\nbody = 'balloon'\nrate = 5", "rooms.main.rate is 5; it must be greater"),
        ("[rooms.main]\nbody = 'balloon'\nmax_users = 0", "rooms.main.max_users is 0"),
        ("[rooms.main]\nbody = 'balloon'\nlaws = ['soft']", "rooms.main.laws.0 is 'soft'"),
        ("[rooms.main]\nbody = 'balloon'\nlaws = []", "rooms.main.laws is []"),
        ("[rooms.main]\nmax_users = 1", "rooms.main.body is missing"),
        ("[rooms.main]\nbody = 'gone.stl'", "rooms.main.body is "),
        ("[rooms.Main]\nbody = 'balloon'", "rooms.Main is 'Main'; it must be named with 1 to 64"),
        ("[rooms.main]\nbody = 'balloon'\n[rooms.main.limits]\nopn = 1", "rooms.main.limits.opn"),
        (
            "[rooms.main]\nbody = 'balloon'\n[rooms.main.limits]\nsamples = 0",
            "rooms.main.limits.samples is '0'; it must be RATE:BURST",
        ),
        (
            "[rooms.main]\nbody = 'balloon'\n[rooms.main.object]\nyoung = 'soft'",
            "rooms.main.object.young is 'soft'",
        ),
        ("[limits]\nopen = 'many'\n[rooms.main]\nbody = 'balloon'", "limits.open is 'many'"),
        ("allow_hosts = ['a b']\n[rooms.main]\nbody = 'balloon'", "allow_hosts: host is 'a b'"),
        ("allow_frames = ['*']\n[rooms.main]\nbody = 'balloon'", "allow_frames: frame is '*'"),
        ("rooms = {}", "rooms is {}"),
        ("port = = 1", "is not TOML: Invalid value (at line 1, column 8)"),
    ],
)
def test_every_error_names_its_key(tmp_path: Path, line: str, key: str) -> None:
    found = problems(tmp_path, line)
    assert any(problem.startswith(key) for problem in found), found


@pytest.mark.parametrize(
    ("name", "value", "reported"),
    [
        ("ROOMS__MAIN__RATE", "fast", f"(environment variable {PREFIX}ROOMS__MAIN__RATE)"),
        ("PROT", "1", f"the environment variable {PREFIX}PROT names no key"),
        ("ALLOW_HOSTS", "lab", "allow_hosts"),
        ("ROOMS__LIVRE__RATE", "60", "rooms.livre.body is missing"),
    ],
)
def test_a_variable_of_the_environment_at_fault_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: str, reported: str
) -> None:
    monkeypatch.setenv(PREFIX + name, value)
    assert reported in "\n".join(problems(tmp_path, TWO))


@given(
    st.builds(
        RoomTable,
        body=st.sampled_from(["balloon", "spring"]),
        rate=st.floats(10.0, 200.0),
        max_users=st.integers(1, 64),
        max_watchers=st.integers(0, 1000),
        limits=st.just({"open": "3"}),
        title=st.just(""),
        laws=st.just((Law.PI,)),
        relaxation=st.floats(0.0, 60.0),
        users=st.none(),
    )
)
def test_what_a_configuration_accepts_a_server_accepts(table: RoomTable) -> None:
    config = RoomsConfig(rooms={"main": table})
    settings = config.settings_of("main")
    assert (settings.simulation_hz, settings.max_users) == (table.rate, table.max_users)


def test_the_page_names_every_key_with_its_default() -> None:
    page = (Path(__file__).parents[3] / "docs/how-to/serve-many-rooms.md").read_text()
    for model in (RoomsConfig, RoomTable):
        for name, field in model.model_fields.items():
            default = field.get_default(call_default_factory=True)
            if isinstance(default, str | bool | int | float) and not isinstance(default, Law):
                sentence = str(default).lower() if isinstance(default, bool) else default
                sentence = f'`"{sentence}"`' if isinstance(default, str) else sentence
                assert f"| `{name}` | {sentence} |" in page, name
            else:
                assert f"`{name}`" in page or f"{name}]`" in page or f"[{name}." in page, name
    for name in (*ObjectTable.model_fields, *dict(Limits().items())):
        assert re.search(rf"[` ]{name}[` ]", page), name


@given(GIVEN)
def test_a_table_makes_the_object_that_the_options_of_a_command_make(
    options: dict[str, Any],
) -> None:
    table, path = ObjectTable.model_validate(options), Path("a.stl")
    assert object_options(table).of(path) == ObjectFile.of(path, options)


def test_the_address_or_network_of_a_proxy_is_one_however_it_is_written(tmp_path: Path) -> None:
    text = "[access]\ntrust_proxy = {}\n[rooms.main]\nbody = 'balloon'\n"
    path = written(tmp_path, text.format("['[::1]', '127.0.0.1', '0:0::1']"))
    assert load_config(path).access.trust_proxy == ("::1", "127.0.0.1", "::1")
    path = written(tmp_path, text.format("['172.18.0.0/16', '[fd00:0::]/48', '10.0.0.1/32']"))
    assert load_config(path).access.trust_proxy == ("172.18.0.0/16", "fd00::/48", "10.0.0.1")
    for wrong in ("lab.example", "172.18.0.1/16", "10.0.0.0/33", "/8", "10.0.0.0/"):
        path = written(tmp_path, text.format(f"['127.0.0.1', '{wrong}']"))
        with pytest.raises(ConfigError, match=r"access\.trust_proxy\.1 is '.*'; .* a network"):
            load_config(path)
