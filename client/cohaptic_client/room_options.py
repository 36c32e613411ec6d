"""Options by which commands name a room and trust its server."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

RoomName = Annotated[str, typer.Option(help="Of a server with several: the same as URL/r/ROOM.")]
CaFile = Annotated[Path | None, typer.Option(help="Certificates that vouch for the server.")]
Insecure = Annotated[bool, typer.Option("--insecure", help="Send a token without TLS.")]
