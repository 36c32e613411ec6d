"""Tables of the configuration file that concern the whole server."""

from __future__ import annotations

import ipaddress
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from cohaptic_server.guard.proxies import NETWORK, network_of


def _network(said: str) -> str:
    try:
        return network_of(said)
    except ValueError:
        raise ValueError(NETWORK) from None


def _address(said: str) -> str:
    try:
        return str(ipaddress.ip_address(said.strip("[]")))
    except ValueError:
        raise ValueError("an address: 127.0.0.1") from None


def _address_or_none(said: str) -> str:
    return _address(said) if said else said


class Table(BaseModel):
    """A table of the configuration file; where a text is expected, a number is accepted as well."""

    model_config = ConfigDict(extra="forbid", frozen=True, coerce_numbers_to_str=True)


class AccessTable(Table):
    """Access control; names and meanings are as for the options of `cohaptic serve`.

    Without `state`, bans and used tokens are stored only for as long as the server runs.

    A proxy has to do TLS, since the server has to read the name of the room from the request, in
    plain text, before it hands the connection to a process.
    """

    keys: Path | None = None
    insecure_key_file: bool = False
    open: bool = False
    single_use: bool = False
    session_valid: str | None = None
    insecure: bool = False
    state: Path | None = None
    # Both the router and the rooms use the proxies to find the sources of connections.
    trust_proxy: tuple[Annotated[str, AfterValidator(_network)], ...] = ()


def _odd(witnesses: tuple[str, ...]) -> tuple[str, ...]:
    # With an even number no more of them may be lost than with one less.
    if witnesses and (len(witnesses) % 2 == 0 or len(set(witnesses)) < len(witnesses)):
        raise ValueError("an odd number of different machines: one, three or five")
    return witnesses


class ClusterTable(Table):
    """Configuration of a cluster, for `--cluster`; the same on each of its machines.

    Anybody who can connect to the port can take rooms away: it belongs into a network of the
    machines alone, as the engine's own ports do.

    Args:
        witnesses: Addresses or names of the machines that grant rooms; more than half of them have
            to run.
        host: Address at which the other machines reach this one; empty for the one from which it
            reaches the engine.
        port: TCP port of all nodes.
        term: Time for which a grant counts [s]: a room of a lost machine starts again after it.
        engine: Address of the engine, HOST:PORT, from `--cluster`; empty for a single machine.
    """

    witnesses: Annotated[
        tuple[Annotated[str, Field(min_length=1, max_length=70)], ...], AfterValidator(_odd)
    ] = Field(default=(), max_length=9)
    host: Annotated[str, AfterValidator(_address_or_none)] = ""
    port: int = Field(default=8764, ge=1, le=65535)
    # A loaded machine may delay a process for a second or two, and users wait for 5 s at most.
    term: float = Field(default=2.5, ge=1.0, le=60.0)
    engine: str = ""


class AdminTable(Table):
    """Configuration of the admin port, as for `--admin`.

    Args:
        port: TCP port, 0 for any free one; None for no admin port.
        host: Address to listen on. Anybody who can connect to this address can read the names and
            delays of all users.
    """

    port: int | None = Field(default=None, ge=0, le=65535)
    host: Annotated[str, AfterValidator(_address)] = "127.0.0.1"
