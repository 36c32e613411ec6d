"""Addresses of this machine, as others reach it."""

from __future__ import annotations

import socket

# Nothing is sent there: the system says from which address it would. The first stands for the rest
# of the world, the others for networks that are not its way there (RFC 5737, 1918, 3849).
_TARGETS = (
    (socket.AF_INET, "192.0.2.1"),
    (socket.AF_INET, "192.168.255.254"),
    (socket.AF_INET, "10.255.255.254"),
    (socket.AF_INET, "172.31.255.254"),
    (socket.AF_INET6, "2001:db8::1"),
)
_PORT = 9


def machine_addresses() -> tuple[str, ...]:
    """Each once, the one on the way to the world first; none without a network."""
    found: list[str] = []
    for family, target in _TARGETS:
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((target, _PORT))
                found.append(str(probe.getsockname()[0]))
        except OSError:
            continue  # no such network here
    return tuple(dict.fromkeys(found))
