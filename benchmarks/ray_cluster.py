"""Ray on three nodes: what it costs, how soon it notices what fails, and what rooms feel of it.

    python benchmarks/ray_cluster.py RAY [--default] [--redis SERVER] [--json FILE]

RAY is the interpreter of an environment with Ray 2.60, and SERVER a `redis-server` with which the
head keeps its state. The nodes are network namespaces, which need Linux, iproute2 and the rights of
root. It takes six minutes. Rooms are detached actors that come back anywhere; told are

- start, memory and processors of each node, calls, and the lateness of ticks in actors and beside;
- for how long rooms are silent when one is killed, and when a node is killed, cut off or paused,
  and for how long a room then has two owners that tick, once the node is back;
- the longest silence of rooms on other nodes while the head is gone for a minute, and in the next.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import json_report
from cluster_nodes import HUB, NODES, Heard, Network, address, network, quantiles, tick, until
from ray_rooms import PORT, ROOMS

_STORE = 6390
_DRIVER = str(Path(__file__).with_name("ray_rooms.py"))
# s before each further node: one that starts while another does may fail.
_APART = 6.0
_AWAY = 60.0  # s for which the head is gone
_LOST = 30.0  # s for which a node is cut off or paused
# A node is dead after three checks in half-second steps have failed; by default 18 s pass. A node
# ends itself if the head has been gone for the last of these times; by default after 60 s.
SOON: Final = {
    "health_check_initial_delay_ms": 500,
    "health_check_period_ms": 500,
    "health_check_timeout_ms": 500,
    "health_check_failure_threshold": 3,
    "gcs_rpc_server_reconnect_timeout_s": 600,
}


class Cluster:
    """Ray on the nodes.

    Args:
        python: Interpreter with Ray.
        nodes: The nodes.
        config: Settings of the head.
        stored: Whether the head keeps its state in the store.
    """

    def __init__(
        self, python: str, nodes: Network, config: Mapping[str, int], *, stored: bool
    ) -> None:
        self._python, self._nodes, self._config, self._stored = python, nodes, config, stored
        self._folder = tempfile.mkdtemp(prefix="ray")  # sockets have short paths

    def start(self, node: int) -> None:
        """Start the engine on a node; node 1 has the head."""
        own = [f"--node-ip-address={address(node)}", "--num-cpus=4", "--block"]
        own.append("--disable-usage-stats")
        if node == 1:
            own += ["--head", f"--port={PORT}", "--include-dashboard=false"]
            own += [f"--temp-dir={self._folder}", f"--system-config={json.dumps(self._config)}"]
        else:
            own.append(f"--address={address(1)}:{PORT}")
        store = {"RAY_REDIS_ADDRESS": f"{HUB}:{_STORE}"} if self._stored else {}
        command = [str(Path(self._python).with_name("ray")), "start", *own]
        with Path(self._folder, f"node{node}.log").open("ab") as log:
            subprocess.Popen(
                self._nodes.command(node, *command), stdout=log, stderr=log, env=os.environ | store
            )

    def drive(self, what: str) -> list[list[float]]:
        """Run `ray_rooms.py` on node 1; return the times of its look-ups and calls [s]."""
        command = self._nodes.command(1, self._python, _DRIVER, what)
        out = subprocess.check_output(command, text=True)
        times: list[list[float]] = json.loads(out.strip().splitlines()[-1])
        return times


def head_listens() -> bool:
    """Return whether the head takes connections."""
    try:
        socket.create_connection((address(1), PORT), 1.0).close()
    except OSError:
        return False
    return True


def start(cluster: Cluster, nodes: Network, heard: Heard) -> dict[str, Any]:
    """Start all nodes and rooms; return what they cost."""
    begin = time.monotonic()
    cluster.start(1)
    until(head_listens)
    for node in NODES[1:]:
        time.sleep(_APART)
        cluster.start(node)
    cluster.drive("rooms")
    until(lambda: len(heard.rooms) == ROOMS)
    took = time.monotonic() - begin
    time.sleep(3.0)
    return {
        "until all rooms tick [s]": round(took, 1),
        "rooms of each node": [len(heard.of_node(node)) for node in NODES],
        "processors of each node": nodes.in_use(10.0),
        "memory of each node [MB]": [nodes.memory(node) for node in NODES],
    }


def lateness(cluster: Cluster, nodes: Network, heard: Heard) -> dict[str, Any]:
    """Return the times of calls, and the lateness of ticks in actors and beside them [ms]."""
    looked, called = cluster.drive("calls")
    command = nodes.command(2, sys.executable, __file__, "--tick")
    beside = [subprocess.Popen([*command, f"beside{k}"]) for k in range(4)]
    when = time.monotonic() + 2.0
    time.sleep(32.0)
    for process in beside:
        process.kill()
        process.wait()
    late = {"actors": list[float](), "beside": list[float]()}
    for room in heard.of_node(2):
        kind = "beside" if room.startswith("beside") else "actors"
        late[kind] += [one.late for one in heard.since(room, when)]
    for room in [room for room in heard.rooms if room.startswith("beside")]:
        del heard.rooms[room]
    return {
        "look-up [ms]": quantiles(looked),
        "call [ms]": quantiles(called),
        **{f"lateness, {kind} [ms]": quantiles(times) for kind, times in late.items()},
    }


def lose_rooms(cluster: Cluster, nodes: Network, heard: Heard) -> dict[str, Any]:
    """Kill a room; kill, cut off and pause a node."""
    reported = dict[str, Any]()
    room, when = heard.of_node(2)[0], time.monotonic()
    os.kill(heard.rooms[room][-1].pid, signal.SIGKILL)
    reported["room killed: silent [s]"] = heard.silences([room], when)
    rooms = heard.of_node(3)
    when = nodes.signal(3, signal.SIGKILL)
    reported["node killed: silent [s]"] = heard.silences(rooms, when, 3)
    for what in ("cut off", "paused"):
        time.sleep(5.0)
        cluster.start(3)
        time.sleep(8.0)
        for room in list(heard.rooms)[:6]:  # some come back on the new node
            os.kill(heard.rooms[room][-1].pid, signal.SIGKILL)
        time.sleep(8.0)
        rooms = heard.of_node(3)
        cut = what == "cut off"
        when = nodes.cable(3, "down") if cut else nodes.signal(3, signal.SIGSTOP)
        reported[f"node {what}: silent [s]"] = heard.silences(rooms, when, 3)
        time.sleep(max(0.0, when + _LOST - time.monotonic()))
        back = nodes.cable(3, "up") if cut else nodes.signal(3, signal.SIGCONT)
        time.sleep(20.0)
        reported[f"node {what}: two owners in the 20 s after [s]"] = heard.overlaps(
            rooms, when, back
        )
        nodes.signal(3, signal.SIGKILL)
    return reported


def lose_head(cluster: Cluster, nodes: Network, heard: Heard) -> dict[str, Any]:
    """Kill the head, and start it again after a minute."""
    rooms = heard.of_node(2)
    when = nodes.signal(1, signal.SIGKILL)
    time.sleep(_AWAY)
    cluster.start(1)
    time.sleep(_AWAY)
    back = when + _AWAY
    return {
        "head gone for a minute: longest silence [s]": heard.longest(rooms, when, back),
        "the minute after: longest silence [s]": heard.longest(rooms, back, back + _AWAY),
        "rooms of node 2 that tick in the end": len(
            [room for room in rooms if heard.rooms[room][-1].at > time.monotonic() - 1.0]
        ),
    }


def main() -> None:
    """Entry point."""
    parser = json_report.parser(__doc__)
    parser.add_argument("ray", nargs="?", default="", help="interpreter with Ray")
    parser.add_argument("--default", action="store_true", help="with Ray's own health checks")
    parser.add_argument("--redis", default="", help="program of the store")
    parser.add_argument("--head", action="store_true", help="only what the loss of the head does")
    parser.add_argument("--tick", default="", help="tick as this room; for this program itself")
    a = parser.parse_args()
    if a.tick:
        tick(a.tick)
    with network() as nodes:
        heard, store = Heard(), None
        heard.start()
        if a.redis:
            command = [a.redis, "--bind", HUB, "--port", str(_STORE), "--protected-mode", "no"]
            store = subprocess.Popen([*command, "--save", ""], stdout=subprocess.DEVNULL)
        cluster = Cluster(a.ray, nodes, {} if a.default else SOON, stored=bool(a.redis))
        results = list[json_report.Result]()
        try:
            parts = (start, lose_head) if a.head else (start, lateness, lose_rooms, lose_head)
            for part in parts:
                reported = part(cluster, nodes, heard)
                print(json.dumps(reported, indent=1), flush=True)
                results += [
                    {"measured": name, "found": json.dumps(v)} for name, v in reported.items()
                ]
        finally:
            if store is not None:
                store.kill()
        json_report.write(a, results)


if __name__ == "__main__":
    main()
