from __future__ import annotations

import ipaddress
import socket

import pytest

from cohaptic_server.shell.own_addresses import machine_addresses


@pytest.mark.live
def test_every_address_is_one_of_this_machine_and_said_once() -> None:
    found = machine_addresses()
    assert len(set(found)) == len(found)
    for address in found:
        family = socket.AF_INET6 if ipaddress.ip_address(address).version == 6 else socket.AF_INET
        with socket.socket(family) as own:
            own.bind((address, 0))  # raises for an address of another
