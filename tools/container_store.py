"""A store of podman's for one run: what is made in it is nowhere else, and goes with its folder.

Podman's settings say where images, containers, volumes, networks and locks are kept. All of them
are put into one folder, so that names of images that are made here are true here alone: elsewhere
podman still takes `docker.io/library/caddy` for what the registry has.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

LONGEST = 900.0  # s that one command may take
# Where Debian keeps what podman starts by itself.
HELPERS = ("/usr/sbin", "/sbin", "/usr/lib/podman", "/usr/libexec/podman")
# Debian's packages by a command of each; of several commands one is enough.
PACKAGES = {
    ("podman",): "podman",
    ("runc", "crun"): "runc",
    ("netavark",): "netavark",
    ("aardvark-dns",): "aardvark-dns",
    ("iptables",): "iptables",
    ("debootstrap",): "debootstrap",
}


class Failed(Exception):
    """What is wrong, for whoever started this, and what to do about it."""


def found(command: str) -> str | None:
    """Path of a command, also of one that only podman and the superuser start."""
    return shutil.which(command, path=os.pathsep.join([os.environ.get("PATH", ""), *HELPERS]))


def missing(look: Callable[[str], str | None] = found) -> list[str]:
    """Debian's packages that this needs and that are not installed."""
    return [package for names, package in PACKAGES.items() if not any(map(look, names))]


def own_environment() -> dict[str, str]:
    """That of this process, without what sends podman to another machine or another of itself."""
    return {name: v for name, v in os.environ.items() if not name.startswith("CONTAINER_")}


def mounts_below(folder: Path, mounts: str) -> list[str]:
    """Mount points in a folder, the deepest first.

    Args:
        folder: With its whole path.
        mounts: The text of /proc/self/mounts, where a space is written as an octal number.
    """
    points = [
        re.sub(r"\\([0-7]{3})", lambda code: chr(int(code[1], 8)), line.split()[1])
        for line in mounts.splitlines()
    ]
    below = {point for point in points if Path(folder) in Path(point).parents}
    return sorted(below, key=lambda point: (-point.count("/"), point))


def said(
    command: Sequence[str | Path],
    aim: str,
    *,
    environment: Mapping[str, str] | None = None,
    stdin: str = "",
    folder: Path | None = None,
    mixed: bool = False,
) -> str:
    """Run a command and return its standard output.

    Args:
        command: With its arguments.
        aim: For people, if it fails: "making the base".
        environment: Beside that of this process.
        stdin: Text for it.
        folder: That it runs in.
        mixed: Whether its errors come with its output.

    Raises:
        Failed: It failed, or took longer than `LONGEST`; with the last lines that it wrote.
    """
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT if mixed else subprocess.PIPE,
        text=True,
        errors="replace",
        env=own_environment() | dict(environment or {}),
        cwd=folder,
        start_new_session=True,
    ) as process:
        try:
            out, wrong = process.communicate(stdin, LONGEST)
        except subprocess.TimeoutExpired as error:
            end(process)
            raise Failed(f"{aim} took longer than {LONGEST:g} s: {command[0]}") from error
        except BaseException:
            end(process)
            raise
    if process.returncode:
        lines = "\n".join((out + (wrong or "")).strip().splitlines()[-15:])
        raise Failed(f"{aim} failed; {command[0]} ended with {process.returncode}:\n{lines}")
    return out


def end(process: subprocess.Popen[str]) -> None:
    """End a process and all that it has started; debootstrap first takes back what it mounted."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError, subprocess.TimeoutExpired):
            os.killpg(process.pid, number)
            process.wait(10.0)


def delete(folder: Path) -> None:
    """Delete a folder, without what is mounted in it.

    Raises:
        Failed: Something in it is still in use.
    """
    mounts = Path("/proc/self/mounts")
    for point in mounts_below(folder, mounts.read_text()):
        subprocess.run(["umount", point], capture_output=True, check=False)
    # It may be the machine's /proc.
    if left := mounts_below(folder, mounts.read_text()):
        raise Failed(f"{left[0]} is in use; end what uses it, and umount it")
    shutil.rmtree(folder)


@dataclass(frozen=True, slots=True)
class Store:
    """A folder with everything that podman keeps.

    Args:
        folder: Folder of this run alone; `open` makes it.
    """

    folder: Path

    @property
    def environment(self) -> dict[str, str]:
        """Variables that make podman, and who starts it, use this store."""
        return {
            "CONTAINERS_CONF": str(self.folder / "containers.conf"),
            "CONTAINERS_STORAGE_CONF": str(self.folder / "storage.conf"),
            # Only Docker's format of images has a HEALTHCHECK.
            "BUILDAH_FORMAT": "docker",
        }

    def settings(self, runtime: str) -> dict[str, str]:
        """Podman's two files, by their names.

        Args:
            runtime: Name of what starts containers.
        """
        at = self.folder
        return {
            # Limits that the user of any machine may set; podman's own need more rights than
            # some machines give their superuser.
            "containers.conf": f"""[containers]
default_ulimits = ["nofile=1024:4096", "nproc=1024:2048"]
log_driver = "k8s-file"
[engine]
runtime = "{runtime}"
tmp_dir = "{at}/state"
volume_path = "{at}/volumes"
lock_type = "file"
events_logger = "file"
[network]
network_backend = "netavark"
network_config_dir = "{at}/networks"
""",
            "storage.conf": f"""[storage]
driver = "overlay"
runroot = "{at}/run"
graphroot = "{at}/images"
""",
        }

    @property
    def is_open(self) -> bool:
        """Whether podman may have put something into it."""
        return (self.folder / "storage.conf").exists()

    def open(self) -> None:
        """Make the folder, with the settings.

        Raises:
            Failed: Podman does not start, or keeps things elsewhere all the same.
        """
        # runc also works where cgroups are of both kinds, and crun does not.
        runtime = "runc" if found("runc") else "crun"
        self.folder.mkdir()
        for name, text in self.settings(runtime).items():
            (self.folder / name).write_text(text)
        self.check()

    def check(self) -> None:
        """Make sure that podman uses this store, and none with containers of other people.

        Raises:
            Failed: It does not start, or keeps its images elsewhere.
        """
        where = self.podman("info", "--format", "{{.Store.GraphRoot}}", aim="asking podman").strip()
        if where != f"{self.folder}/images":
            raise Failed(f"podman keeps its images in {where} and not in {self.folder}/images")

    def podman(self, *arguments: str, aim: str, stdin: str = "", mixed: bool = False) -> str:
        """Run podman on this store; see `said`."""
        command = ["podman", *arguments]
        return said(command, aim, environment=self.environment, stdin=stdin, mixed=mixed)

    def clear(self) -> None:
        """End and remove all containers, and their networks.

        Raises:
            Failed: Podman could not.
        """
        self.check()
        aim = "removing the containers"
        names = self.podman("ps", "--all", "--quiet", aim=aim).split()
        if names:  # with those that depend on them, or the order would matter
            self.podman("rm", "--force", "--depend", "--ignore", "--time", "5", *names, aim=aim)
        self.podman("pod", "rm", "--all", "--force", aim=aim)
        self.podman("network", "prune", "--force", aim=aim)
