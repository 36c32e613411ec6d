"""A machine whose hosts file has ::1, and which has no IPv6."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.give_up import give_up
from tests.patience import PATIENCE

pytestmark = pytest.mark.live

HOSTS = "127.0.0.1 localhost\n::1 localhost\n::1 only6\n"
MACHINE = "ip link set lo up && ip -6 addr del ::1/128 dev lo && mount --bind '{}' /etc/hosts"
ROOMS = "host = 'localhost'\nport = 8765\n[admin]\nport = 9100\n[rooms.main]\nbody = 'balloon'\n"
# Runs on that machine: starts a server, asks at each port, and ends it.
VISIT = """
import subprocess, sys, urllib.request
from urllib.request import ProxyHandler, build_opener
server = subprocess.Popen(
    [sys.executable, "-m", "cohaptic", "serve", *sys.argv[1:]],
    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
)
print(first := server.stdout.readline(), end="")
if first:
    for port, path in ((8765, ""), (9100, "metrics")):
        url = f"http://localhost:{port}/{path}"
        print(port, build_opener(ProxyHandler({})).open(url).status)
    server.terminate()
print(server.communicate()[1])
"""


def on_it(folder: Path, *arguments: str) -> str:
    """What a server there says, and how it answers."""
    if sys.platform != "linux" or shutil.which("unshare") is None:
        give_up("a machine of its own needs Linux and unshare")
    hosts, visit = folder / "hosts", folder / "visit.py"
    hosts.write_text(HOSTS)
    visit.write_text(VISIT)
    machine = ["unshare", "-rnm", "sh", "-c", MACHINE.format(hosts) + ' && exec "$@"', "sh"]
    if subprocess.run([*machine, "true"], check=False, capture_output=True).returncode:
        give_up("a machine without IPv6 cannot be made here")
    done = subprocess.run(
        [*machine, sys.executable, str(visit), *arguments],
        capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout


def config(folder: Path) -> str:
    path = folder / "rooms.toml"
    path.write_text(ROOMS)
    return str(path)


@pytest.mark.parametrize("many", [False, True], ids=["one room", "rooms"])
def test_a_name_is_served_at_the_addresses_that_work_and_the_others_are_told(
    tmp_path: Path, many: bool
) -> None:
    one = ("--host", "localhost", "--port", "8765", "--admin", "localhost:9100")
    said = on_it(tmp_path, *(("--config", config(tmp_path)) if many else one))
    assert said.startswith("listening ws://localhost:8765\n8765 200\n9100 200\n")
    assert said.count("nobody comes in by ::1, an address of localhost: ") == (1 if many else 2)
