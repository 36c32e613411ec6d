"""Addresses of machines, and which of them is this one."""

from __future__ import annotations

import contextlib
import socket

from cohaptic.errors import SettingError


def host_port(host: str, port: int) -> str:
    """Return an address as HOST:PORT, with brackets around an IPv6 host."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def host_of(address: str) -> str:
    """Return the host of HOST:PORT, without brackets."""
    return address.rpartition(":")[0].strip("[]")


def own_address(engine: str) -> str:
    """Return the IP address from which this machine reaches the engine at HOST:PORT.

    Raises:
        SettingError: The engine's address is wrong, or there is no way to it.
    """
    host, _, port = engine.rpartition(":")
    try:
        if not host:
            raise ValueError("no host")
        # Nothing is sent: a datagram socket only looks up the way.
        kind = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(kind, socket.SOCK_DGRAM) as probe:
            probe.connect((host.strip("[]"), int(port)))
            return str(probe.getsockname()[0])
    except (OSError, ValueError) as error:
        limit = f"HOST:PORT of the first machine's engine, such as 10.0.0.1:6379 ({error})"
        raise SettingError("--cluster", engine, limit) from error


def is_here(name: str, host: str) -> bool:
    """Whether a name or an address is this machine's.

    Args:
        name: Name or IP address, as the configuration has it.
        host: IP address of this machine.
    """
    if name in (host, socket.gethostname()) or name.partition(".")[0] == socket.gethostname():
        return True
    with contextlib.suppress(OSError):  # a name that nobody knows yet is another machine's
        return host in {str(found[4][0]) for found in socket.getaddrinfo(name, None)}
    return False
