"""Builds the image and brings docker-compose.yml up, on a bare Debian machine with podman.

    python tools/containers.py [--install] [--wheels dist] [--mirror URL]

No registry is asked: the images that the files name are made here, from Debian's packages, in a
store that is deleted at the end (`container_store.py`). They stand in for what the registry has:
Python is Debian's and so are Caddy and Prometheus. There is no Grafana in Debian.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from cohaptic.clock import SystemClock
from container_store import Failed, Store, delete, missing, said

ROOT = Path(__file__).parents[1]
SUITE = "bookworm"  # whose Python, 3.11, is the oldest that cohaptic runs on
PYTHON = "3.11"
# Debian 12 has 1.0.3, which knows no address of a service.
COMPOSE = "podman-compose==1.6.0"
SPACE = 6.0  # GB
# Another wheel of ours beside the built one; pip takes the newer, and never opens this.
OLDER = "cohaptic-0.0.0-py3-none-any.whl"
EXTRA, EXTRA_MODULE = "scans", "nibabel"  # the smallest extra, and what it brings
PATIENCE = 120.0 * float(os.environ.get("COHAPTIC_PATIENCE", "1"))  # s
PROXY, PROMETHEUS = 8443, 9090  # ports that the compose file publishes
SERVER = "cohaptic_server_1"
ROOT_CERTIFICATE = "/data/caddy/pki/authorities/local/root.crt"
# Nobody in a container reads these.
LEFT_OUT = ("./proc/*", "./sys/*", "./var/cache/apt", "./var/lib/apt", "./usr/share/doc")
# What the registry's images say of themselves, as far as the compose file counts on it.
CADDY = """FROM {base}
ENV XDG_CONFIG_HOME=/config XDG_DATA_HOME=/data
CMD ["caddy", "run", "--config", "/etc/caddy/Caddyfile", "--adapter", "caddyfile"]
"""
PROMETHEUS_IMAGE = """FROM {base}
RUN install -d -o nobody -g nogroup /prometheus
USER nobody
ENTRYPOINT ["prometheus", "--config.file=/etc/prometheus/prometheus.yml", \\
  "--storage.tsdb.path=/prometheus"]
"""


def tell(text: str) -> None:
    """Print a line of progress, also into a pipe."""
    print(text, flush=True)


def image_of(service: str, compose: str) -> str:
    """Name of the image of a service.

    Args:
        service: Service of the compose file.
        compose: Its text.
    """
    named = re.search(rf"^  {service}:(?:.*\n(?:    .*\n|\n)*?)    image: (\S+)$", compose, re.M)
    if named is None:
        raise Failed(f"docker-compose.yml names no image for {service}")
    return named[1]


def base_of(dockerfile: str) -> str:
    """Name of the image that ours is built on."""
    named = re.search(r"^ARG BASE=(\S+)$", dockerfile, re.M)
    if named is None:
        raise Failed("deploy/Dockerfile has no line ARG BASE=")
    return named[1]


def feels(line: str, *, others: bool = False) -> bool:
    """Whether a line of `cohaptic touch --json-lines` tells of a force.

    Args:
        line: Any line of its output.
        others: Whether the force has to come from other users.
    """
    key = "felt_from_others" if others else "force"
    number = re.search(rf'^{{.*"{key}": ?([0-9.e-]+)', line)
    return number is not None and float(number[1]) > 0.0


def until(aim: str, done: Callable[[], Any]) -> Any:
    """Try until something true comes back, and return that.

    Args:
        aim: For people: "the server to be ready".
        done: What is tried; failing to connect counts as false.

    Raises:
        Failed: It did not within `PATIENCE`.
    """
    last: object = ""
    clock, pause = SystemClock(), threading.Event()
    ends = clock.now() + PATIENCE
    while clock.now() < ends:
        try:
            if result := done():
                return result
        except (OSError, http.client.HTTPException, Failed) as error:
            last = error
        pause.wait(0.5)
    raise Failed(f"waited {PATIENCE:g} s for {aim}, in vain {last}".rstrip())


def got(url: str, context: ssl.SSLContext | None = None) -> bytes:
    """The body of a page of this machine, whatever proxy the environment names."""
    handlers: list[urllib.request.BaseHandler] = [urllib.request.ProxyHandler({})]
    if context is not None:
        handlers.append(urllib.request.HTTPSHandler(context=context))
    with urllib.request.build_opener(*handlers).open(url, timeout=10.0) as answer:
        return bytes(answer.read())


@dataclass(frozen=True, slots=True)
class Run:
    """One run: a store, and beside it a folder with what the compose file needs.

    Args:
        store: Store of podman.
        folder: With docker-compose.yml, deploy/, dist/ and a podman-compose.
    """

    store: Store
    folder: Path

    @property
    def compose_file(self) -> str:
        """Text of the compose file."""
        return (self.folder / "docker-compose.yml").read_text()

    def compose(self, *arguments: str, aim: str) -> str:
        """Run podman-compose."""
        environment = {**self.store.environment, "PYTHONPATH": str(self.folder / "compose")}
        # It starts podman by its name, and Python by that of this one.
        command = [sys.executable, "-m", "podman_compose", *arguments]
        return said(command, aim, environment=environment, folder=self.folder)

    def make_base(self, mirror: str | None) -> None:
        """An image of Debian with Python, Caddy and Prometheus; None for debootstrap's mirror."""
        root, base = self.folder / "debian", base_of((ROOT / "deploy/Dockerfile").read_text())
        packages = "python3,python3-venv,ca-certificates,caddy,prometheus"
        chosen = ["--variant=minbase", f"--include={packages}", SUITE, str(root)]
        said(["debootstrap", *chosen, *([mirror] if mirror else [])], "making a Debian")
        # The registry's image calls it so.
        (root / "usr/bin/python").symlink_to("python3")
        left_out = [f"--exclude={name}" for name in LEFT_OUT]
        archive = self.folder / "debian.tar"
        said(["tar", "-C", root, "--one-file-system", *left_out, "-cf", archive, "."], "packing it")
        self.store.podman("import", str(archive), base, aim="importing it")
        archive.unlink()
        shutil.rmtree(root)
        for service, text in (("proxy", CADDY), ("prometheus", PROMETHEUS_IMAGE)):
            name = image_of(service, self.compose_file)
            empty = self.folder / "empty"
            empty.mkdir(exist_ok=True)
            command = ("build", "--network=none", "--tag", name, "--file", "-", str(empty))
            self.store.podman(*command, aim=f"making {name}", stdin=text.format(base=base))

    def make_image(self, wheel: Path) -> None:
        """The image as the compose file says, without a network: all wheels lie beside ours.

        So does an older one of ours, as after two builds, which must not be taken; and a second
        image has an extra.
        """
        dist = self.folder / "dist"
        dist.mkdir()
        shutil.copy(wheel, dist)
        shutil.copy(wheel, dist / OLDER)
        pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
        only = ["--only-binary=:all:", f"--python-version={PYTHON}"]
        pinned = [f"--constraint={ROOT / 'constraints.txt'}"]
        wanted = f"{wheel}[{EXTRA}]"
        said([*pip, "download", *only, *pinned, "--dest", dist, wanted], "fetching what it needs")
        said([*pip, "install", "--target", self.folder / "compose", COMPOSE], f"fetching {COMPOSE}")
        build = ("--podman-build-args=--network=none", "build", "server")
        self.compose(*build, aim="building the image")
        if not self.store.podman(
            "image", "inspect", "--format", "{{.HealthCheck}}", "cohaptic", aim="looking at it"
        ).startswith("{[CMD python"):
            raise Failed("the image was built without its HEALTHCHECK")
        self.store.podman(
            "build", "--format=docker", "--network=none", f"--build-arg=EXTRAS=[{EXTRA}]",
            "--tag", "cohaptic:extra", "--file", "deploy/Dockerfile", str(self.folder),
            aim=f"building the image with [{EXTRA}]",
        )  # fmt: skip
        for image, status in (("cohaptic", "1"), ("cohaptic:extra", "0")):
            asked = f"python -c 'import {EXTRA_MODULE}' 2>/dev/null; echo $?"
            run = ("run", "--rm", "--network=none", "--entrypoint=/bin/sh", image, "-c", asked)
            if self.store.podman(*run, aim="looking into it").strip() != status:
                raise Failed(f"{image} has {EXTRA_MODULE}, or lacks it, against its EXTRAS")

    def logged(self, service: str) -> list[str]:
        """What a container has written, line by line."""
        name = f"cohaptic_{service}_1"
        return self.store.podman("logs", name, aim="reading its log", mixed=True).splitlines()

    def feels_others(self, hand: str) -> bool:
        """Whether a hand has felt the other one."""
        return any(feels(line, others=True) for line in self.logged(hand))

    def healthy(self) -> bool:
        """Whether the image's own check finds the server ready."""
        self.store.podman("healthcheck", "run", SERVER, aim="the check")
        return True

    def certificate(self) -> Path:
        """That of whoever signed the proxy's, which the proxy made."""
        command = ("exec", "cohaptic_proxy_1", "cat", ROOT_CERTIFICATE)

        def whole() -> str:
            text = self.store.podman(*command, aim="asking the proxy")
            return text if text.rstrip().endswith("END CERTIFICATE-----") else ""

        path = self.folder / "root.crt"
        path.write_text(until("the proxy's certificate", whole))
        return path

    def check_as_it_is(self) -> list[str]:
        """Bring everything up, and look at it; returns what held."""
        services = ("server", "ada", "grace", "proxy", "prometheus")
        up = ("--profile", "watched", "up", "--detach", "--no-build", *services)
        self.compose(*up, aim="docker-compose.yml")
        until("the server to be ready", self.healthy)
        context = ssl.create_default_context(cafile=str(self.certificate()))
        url = f"https://localhost:{PROXY}/"
        until(f"the page at {url}", lambda: b"<html" in got(url, context).lower())
        tell("   the page comes through the proxy")
        for hand in ("ada", "grace"):
            until(f"{hand} to feel the other", partial(self.feels_others, hand))
        tell("   ada and grace feel each other")
        query = f"http://127.0.0.1:{PROMETHEUS}/api/v1/query?query=cohaptic_users"
        until("Prometheus to see two users", lambda: scraped(got(query)) == 2.0)
        tell("   Prometheus sees two users")
        self.stop()
        return ["page through TLS", "two hands felt each other", "Prometheus saw both"]

    def stop(self) -> None:
        """End the server as an engine does, then all else.

        Raises:
            Failed: It had to be killed.
        """
        self.store.podman("stop", "--time", "15", SERVER, aim="stopping the server")
        ended = ("inspect", "--format", "{{.State.ExitCode}}", SERVER)
        status = self.store.podman(*ended, aim="looking at it").strip()
        if status != "0":
            raise Failed(
                f"SIGTERM did not end the server with 0 but {status}: {self.logged('server')[-3:]}"
            )
        tell("   SIGTERM ends the server with 0")
        self.compose("--profile", "watched", "down", aim="taking it down")

    def check_with_keys(self) -> list[str]:
        """Bring it up for who has a token, and come with one and without; returns what held."""
        keys = self.folder / "keys.json"
        cohaptic = [sys.executable, "-m", "cohaptic"]
        said([*cohaptic, "key", keys], "making keys")
        os.chown(keys, 10001, 10001)
        files = ("--file", "docker-compose.yml", "--file", "deploy/keys.compose.yml")
        up = ("up", "--detach", "--no-build", "server", "proxy")
        self.compose(*files, *up, aim="deploy/keys.compose.yml")
        until("the server to be ready", self.healthy)
        token = said([*cohaptic, "token", "--keys", keys], "making a token").strip()
        url = f"wss://localhost:{PROXY}"
        touch = [*cohaptic, "touch", url, "--depth-mm", "20", "--wait", f"{PATIENCE:g}",
                 "--ca-file", str(self.certificate()), "--json-lines"]  # fmt: skip
        if not felt(touch, token):
            raise Failed("who has a token felt nothing through the proxy")
        if felt(touch, None):
            raise Failed("who has no token touched all the same")
        if not any('"event": "refused"' in line for line in self.logged("server")):
            raise Failed("who has no token felt nothing, but was not refused by the server either")
        tell("   who has a token touches through the proxy, and nobody else")
        joined = [line for line in self.logged("server") if '"event": "joined"' in line]
        sources = {json.loads(line)["source"] for line in joined}
        address = re.search(r"ipv4_address: ([\d.]+)", self.compose_file)
        if not sources or address is None or address[1] in sources:
            raise Failed(f"the server takes users for the proxy, and sees them at {sources}")
        self.stop()
        return ["a token touched through the proxy, and nothing without", "SIGTERM ended with 0"]


def scraped(body: bytes) -> float | None:
    """The value that Prometheus answers with; None for no or several."""
    found = json.loads(body)["data"]["result"]
    return float(found[0]["value"][1]) if len(found) == 1 else None


def felt(command: list[str], token: str | None) -> bool:
    """Whether a hand feels a force before it ends, or before `PATIENCE` does; it is told to end."""
    environment = {name: said for name, said in os.environ.items() if name != "COHAPTIC_TOKEN"}
    if token is not None:
        environment["COHAPTIC_TOKEN"] = token
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment,
    ) as process:  # fmt: skip
        late = threading.Timer(PATIENCE, process.kill)
        late.start()
        assert process.stdout is not None
        try:
            result = any(feels(line) for line in process.stdout)
        finally:
            late.cancel()
            process.terminate()
            process.stdout.read()
    return result


def checked(wheels: Path, *, install: bool) -> Path:
    """The wheel to build from, where everything is there that this needs.

    Raises:
        Failed: Something is missing.
    """
    if not sys.platform.startswith("linux") or os.geteuid() != 0:
        raise Failed("debootstrap makes files of the superuser's, on Linux: sudo make containers")
    packages = missing()
    if packages and install:
        command = ["apt-get", "install", "--yes", "--no-install-recommends", *packages]
        said(command, "installing", environment={"DEBIAN_FRONTEND": "noninteractive"})
    elif packages:
        raise Failed(
            f"missing: {', '.join(packages)}; apt-get install --no-install-recommends"
            f" {' '.join(packages)}, or make containers ARGS=--install"
        )
    found_wheels = sorted(wheels.glob("cohaptic-*.whl"), key=lambda file: file.stat().st_mtime)
    pure = [file for file in found_wheels if file.name.endswith("-none-any.whl")]
    if not pure:
        raise Failed(f"no wheel of plain Python is in {wheels}: pip wheel --no-deps -w {wheels} .")
    for port in (PROXY, PROMETHEUS):
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                raise Failed(
                    f"port {port} is taken; end what listens there: ss -ltnp sport = {port}"
                )
    return pure[-1]


def folder_with_space() -> Path:
    """A new folder; containers have to be able to pass through it.

    Raises:
        Failed: There is no place for it, or its disk is too full.
    """
    place = os.environ.get("TMPDIR", "/var/tmp")
    if not Path(place).is_dir():
        raise Failed(f"TMPDIR is {place}; it must be a folder with {SPACE:g} GB free")
    if shutil.disk_usage(place).free < SPACE * 1e9:
        raise Failed(f"less than {SPACE:g} GB are free in {place}; TMPDIR names another folder")
    folder = Path(tempfile.mkdtemp(prefix="cohaptic-containers-", dir=place)).resolve()
    folder.chmod(0o755)
    return folder


def play(run: Run, wheel: Path, mirror: str | None) -> list[str]:
    """Everything, one after the other; returns what held."""
    run.store.open()
    shutil.copytree(ROOT / "deploy", run.folder / "deploy")
    for name in ("docker-compose.yml", ".dockerignore"):
        shutil.copy(ROOT / name, run.folder)
    tell("1. a Debian with Python, Caddy and Prometheus; some minutes")
    run.make_base(mirror)
    tell(f"2. the image from {wheel.name}; a minute or two")
    run.make_image(wheel)
    tell("3. docker-compose.yml as it is")
    held = ["image built", *run.check_as_it_is()]
    tell("4. deploy/keys.compose.yml over it")
    return held + run.check_with_keys()


def removed(store: Store, place: Path) -> bool:
    """Take everything away, whatever signal comes; returns whether it is gone.

    What is wrong is printed and not raised: it must not hide why the run failed.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    tell("removing everything")
    try:
        if store.is_open:
            store.clear()
        delete(place)
    except (Failed, OSError) as error:
        print(f"containers: {error}; {place} is left", file=sys.stderr)
        return False
    return True


def interrupted(_number: int, _frame: FrameType | None) -> None:
    """As Ctrl-C."""
    raise KeyboardInterrupt


def main() -> int:
    """Do what the command line says; returns the exit status."""
    parser = argparse.ArgumentParser(
        description="Builds the image and brings docker-compose.yml up with podman."
    )
    parser.add_argument(
        "--install", action="store_true", help="install the packages that are missing"
    )
    parser.add_argument("--wheels", type=Path, default=ROOT / "dist", help="folder with a wheel")
    parser.add_argument("--mirror", help="of Debian's packages, in place of debootstrap's own")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, interrupted)
    try:
        wheel = checked(options.wheels.resolve(), install=options.install)
        place = folder_with_space()
        store = Store(place / "store")
        gone = False
        try:
            held = play(Run(store, place), wheel, options.mirror)
        finally:
            gone = removed(store, place)
    except Failed as error:
        print(f"containers: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("containers: stopped", file=sys.stderr)
        return 130
    tell(f"held: {', '.join(held)}; not tried: Grafana")
    return 0 if gone else 1


if __name__ == "__main__":
    sys.exit(main())
