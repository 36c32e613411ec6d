"""`cohaptic doctor`: finds problems of this machine and its devices, and says how to fix them."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from cohaptic import __version__
from cohaptic.clock import resolution
from cohaptic.errors import DeviceError, SettingError
from cohaptic.runtime.scheduling import memory_lock_limit
from cohaptic_client.devices.catalogue import names, search
from cohaptic_client.devices.hid_devices import unknown_hid
from cohaptic_client.devices.serial_ports import unknown_ports
from cohaptic_client.news import is_real_time

MAX_LATE: Final = 0.001  # share of periods that may start late by more than a period: 0.1 %
MEMORY: Final = 64 << 20  # bytes; a loop's process uses about half of that
_CLOCKS: Final = ("tsc", "arch_sys_counter", "kvm-clock", "hyperv_clocksource_tsc_page")
_NODES: Final = ("hidraw*", "ttyACM*", "ttyUSB*")
# Python packages that drivers use, and what each is for.
_LIBRARIES: Final = (
    ("hidapi", "HID devices"),
    ("pyserial", "serial boards"),
    ("websockets", "the Haply service"),
)
_GRACE: Final = 30.0  # s for the measuring process to start and end


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report: a part of the machine, its state, and advice if there is a problem.

    Args:
        subject: Part of the machine that was examined.
        found: State of that part.
        advice: What the user should do; empty for nothing.
        absent: Whether the part is missing but perhaps not wanted, such as a driver's device.
        wrong: Whether there is a problem, even one without advice.
    """

    subject: str
    found: str
    advice: str = ""
    absent: bool = False
    wrong: bool = False

    @property
    def mark(self) -> str:
        """First word of the line: "absent", "warning" or "ok"."""
        if self.absent:
            return "absent"
        return "warning" if self.advice or self.wrong else "ok"

    def __str__(self) -> str:
        line = f"{self.mark:8} {self.subject}: {self.found}"
        return line + (self.advice and f"\n{'':9}to do: {self.advice}")


def of_measurement(measured: dict[str, Any]) -> list[Finding]:
    """Judge the measured scheduling, memory lock, compiled modules and lateness of a loop.

    Args:
        measured: Dictionary that `loop.running.measure` printed.

    Returns:
        One finding for each of the four.
    """
    real_time = is_real_time(measured["scheduling"])
    locked = measured["memory"] == "memory locked" or sys.platform != "linux"
    late = measured["late_by_a_period"]
    lateness = (
        f"p50 {1e6 * measured['late_p50']:.0f} us, p99 {1e6 * measured['late_p99']:.0f} us, most "
        f"{1e3 * measured['late_most']:.1f} ms; {100.0 * late:.2f} % of {measured['periods']} "
        "periods late by more than one"
    )
    user = "@audio" if Path("/etc/security/limits.d/audio.conf").exists() else "YOUR_NAME"
    limits = "to /etc/security/limits.d/cohaptic.conf, and log in again"
    return [
        Finding(
            "scheduling",
            measured["scheduling"],
            "" if real_time else f"for real time add the line '{user} - rtprio 10' {limits}",
        ),
        Finding(
            "memory",
            measured["memory"],
            "" if locked else f"add the line '{user} - memlock unlimited' {limits}",
        ),
        Finding(
            "loop",
            measured["compiled"],
            "" if measured["compiled"] == "compiled" else "install a wheel, or `make compiled`",
        ),
        Finding(
            "lateness",
            lateness,
            ""
            if late <= MAX_LATE
            else "end other work on this machine, plug in a laptop, switch power saving off",
        ),
    ]


def of_clock(source: str, resolution: float) -> Finding:
    """Judge the clock that this machine's kernel uses.

    Args:
        source: Clock source of the kernel; empty if unknown.
        resolution: Resolution of the clock [s].
    """
    found = f"{source or 'of the system'}, resolution {1e9 * resolution:.0f} ns"
    slow = bool(source) and source not in _CLOCKS
    return Finding("clock", found, "choose tsc if the kernel trusts it: others are slow" * slow)


def of_lock_limit(limit: float) -> Finding:
    """Judge how much memory this process may lock.

    Args:
        limit: Limit of the locked memory [bytes]; inf for no limit.
    """
    words = "no limit" if limit == float("inf") else f"{limit / 2**20:.0f} MiB"
    few = limit < MEMORY and sys.platform == "linux"
    return Finding("memory lock limit", words, f"{MEMORY >> 20} MiB are needed" * few)


def of_nodes(nodes: list[tuple[str, bool]]) -> Finding:
    """Judge whether this user may use the device nodes.

    Args:
        nodes: Path of each node, with whether this user may read and write it.
    """
    if not nodes:
        return Finding("USB devices", "no hidraw or serial node; none is plugged in, or no driver")
    closed = [name for name, may in nodes if not may]
    if not closed:
        return Finding("USB devices", f"{len(nodes)} nodes, all of them open to you")
    advice = (
        "for a serial device join its group (`sudo usermod -aG dialout $USER`, then log in again); "
        'for others add a udev rule with TAG+="uaccess" in /etc/udev/rules.d/70-cohaptic.rules'
    )
    return Finding("USB devices", f"closed to you: {', '.join(closed)}", advice)


def nodes(folder: Path) -> list[tuple[str, bool]]:
    """List the HID and serial device nodes in a folder, each with whether this user may use it."""
    paths = sorted(path for kind in _NODES for path in folder.glob(kind))
    return [(str(path), os.access(path, os.R_OK | os.W_OK)) for path in paths]


def of_machine(seconds: float) -> list[Finding]:
    """Examine this machine, with `seconds` [s] of measured lateness; return all findings."""
    found = [
        Finding("versions", f"cohaptic {__version__}, Python {platform.python_version()}, "
                f"{platform.platform()}, {os.cpu_count()} processors")
    ]  # fmt: skip
    found += of_measurement(_measured(seconds))
    source = Path("/sys/devices/system/clocksource/clocksource0/current_clocksource")
    name = source.read_text().strip() if source.exists() else ""
    found.append(of_clock(name, resolution()))
    found.append(of_lock_limit(memory_lock_limit()))
    if sys.platform == "linux":
        found.append(of_nodes(nodes(Path("/dev"))))
    return found


def _measured(seconds: float) -> dict[str, Any]:
    command = [sys.executable, "-m", "cohaptic_client.loop.running.measure", str(seconds)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=seconds + _GRACE, check=True
    )
    measured: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return measured


def of_devices() -> Iterator[Finding]:
    """Yield the findings on devices, their drivers and the Python packages that drivers use."""
    for package, purpose in _LIBRARIES:
        try:
            yield Finding(package, f"{version(package)}, for {purpose}")
        except PackageNotFoundError:
            yield Finding(package, f"is not installed, for {purpose}", absent=True)
    found, missing = search()
    for each in found:
        subject, found_so = f"{each.choice} ({each.where})", each.problem or "ready"
        yield Finding(subject, found_so, each.advice, wrong=bool(each.problem))
    for error in missing:
        yield Finding(error.device, error.problem, error.advice, absent=True)
    seen = {each.choice.split(":")[0] for each in found} | {error.device for error in missing}
    unseen = [name for name in names() if name not in seen and name != "simulated"]
    if unseen:
        yield Finding(", ".join(unseen), "not plugged in, or not seen by the system", absent=True)
    places = [each.where for each in found]
    for unknown in (unknown_hid, unknown_ports):
        with contextlib.suppress(DeviceError):  # a missing library was reported above
            for other in unknown(places):
                yield Finding(other, "known to no driver here", absent=True)


def doctor(
    seconds: Annotated[
        float, typer.Option(help="How long to measure lateness [s]; 0 looks at devices alone.")
    ] = 5.0,
    look_at_devices: Annotated[
        bool,
        typer.Option(
            "--devices/--no-devices",
            help="Look at devices too, which opens the serial ports of known boards.",
        ),
    ] = True,
) -> None:
    """Check this machine and its devices, and say what to fix.

    Ends with status 1 after a warning.
    """
    if seconds != 0.0 and not 0.1 <= seconds <= 3600.0:
        raise SettingError("seconds", seconds, "0, or from 0.1 to 3600")
    found: list[Finding] = []
    if seconds > 0.0:
        typer.echo(f"measuring lateness for {seconds:g} s", err=True)
        found += of_machine(seconds)
    found += of_devices() if look_at_devices else []
    for finding in found:
        typer.echo(str(finding))
    raise typer.Exit(1 if any(finding.mark == "warning" for finding in found) else 0)
