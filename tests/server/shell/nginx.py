"""`deploy/nginx.conf`, played: the file as it stands, but for its ports and its paths."""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import threading
from collections.abc import Generator
from pathlib import Path

import pytest

from tests.patience import PATIENCE
from tests.server.credentials.pairs import write_pair

CONF = Path(__file__).parents[3] / "deploy/nginx.conf"
# Debian's is beside the paths of ordinary users.
NGINX = shutil.which("nginx", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
NEEDS_NGINX = pytest.mark.skipif(NGINX is None, reason="nginx is not installed")
AS_IN_THE_FILE = (
    'proxy_set_header X-Forwarded-For $remote_addr;\n        proxy_set_header Forwarded "";'
)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as one:
        return int(one.getsockname()[1])


@contextlib.contextmanager
def proxied(url: str, folder: Path, *changes: tuple[str, str]) -> Generator[int]:
    """nginx in front of a server; gives its port.

    Args:
        url: Of the server.
        folder: For its files.
        changes: Of the file: what is in it, and what is to be there.
    """
    assert NGINX is not None
    cert, key = write_pair(folder, "lab.example", "127.0.0.1")
    port = free_port()
    text = CONF.read_text()
    for theirs, ours in [
        *changes,
        ("127.0.0.1:8765;\n}", f"{url.removeprefix('ws://')};\n}}"),
        ("listen 443", f"listen 127.0.0.1:{port}"),
        ("/etc/ssl/lab.example.pem", str(cert)),
        ("/etc/ssl/lab.example.key", str(key)),
    ]:
        assert theirs in text
        text = text.replace(theirs, ours)
    temporary = "".join(
        f"{kind}_temp_path {folder}/{kind};\n"
        for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    whole = (
        f"daemon off; worker_processes 1; pid {folder}/pid; error_log {folder}/error.log;\n"
        f"events {{}}\nhttp {{\naccess_log {folder}/access.log;\n{temporary}{text}}}\n"
    )
    (folder / "nginx.conf").write_text(whole)
    command = [NGINX, "-c", str(folder / "nginx.conf"), "-p", str(folder), "-e", f"{folder}/e.log"]
    nginx = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        for _ in range(int(100 * PATIENCE)):
            assert nginx.poll() is None, (folder / "e.log").read_text()
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                break
            threading.Event().wait(0.01)
        yield port
    finally:
        nginx.terminate()
        nginx.wait(PATIENCE)
