"""Finds the addresses at which other machines reach this machine."""

from __future__ import annotations

import socket

# Nothing is sent to these targets: the system only says from which address it would send. The first
# stands for the internet, the others for private networks and IPv6 (RFC 5737, 1918, 3849).
_TARGETS = (
    (socket.AF_INET, "192.0.2.1"),
    (socket.AF_INET, "192.168.255.254"),
    (socket.AF_INET, "10.255.255.254"),
    (socket.AF_INET, "172.31.255.254"),
    (socket.AF_INET6, "2001:db8::1"),
)
_PORT = 9


def machine_addresses() -> tuple[str, ...]:
    """Return the addresses of this machine, that of the internet route first; () if offline."""
    found: list[str] = []
    for family, target in _TARGETS:
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((target, _PORT))
                found.append(str(probe.getsockname()[0]))
        except OSError:
            continue  # no such network here
    return tuple(dict.fromkeys(found))
