"""Tables of a configuration that concern the whole server."""

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


class Table(BaseModel):
    """A table of the file. Numbers may be given where a text is wanted: a limit, a modulus."""

    model_config = ConfigDict(extra="forbid", frozen=True, coerce_numbers_to_str=True)


class AccessTable(Table):
    """Who may come in, as the options of `cohaptic serve` of the same names.

    Without `state`, bans and used tokens are kept for as long as the server runs.

    TLS is a proxy's: the room is in the request, which has to be read before a process gets it.
    """

    keys: Path | None = None
    insecure_key_file: bool = False
    open: bool = False
    single_use: bool = False
    session_valid: str | None = None
    insecure: bool = False
    state: Path | None = None
    # The front counts with them as well as the rooms.
    trust_proxy: tuple[Annotated[str, AfterValidator(_network)], ...] = ()


class AdminTable(Table):
    """The admin port, as `--admin`.

    Args:
        port: TCP port, 0 for any free one; without it there is no admin port.
        host: Address to listen on. Whoever reaches it reads everybody's names and delays.
    """

    port: int | None = Field(default=None, ge=0, le=65535)
    host: Annotated[str, AfterValidator(_address)] = "127.0.0.1"
