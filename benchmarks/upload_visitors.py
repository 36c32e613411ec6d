"""The visitors of `hostile_uploads.py`, each a process.

    python benchmarks/upload_visitors.py URL NAME FOLDER

Beside those with the files of `tests/uploads/hostile.py` there are visitors who send a byte a
second, who all come at once, and who go in the middle. The last line is what became of the file.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable
from pathlib import Path

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from cohaptic.clock import SystemClock
from cohaptic.protocol.messages import encode_control
from cohaptic.protocol.upload_messages import CHUNK, SUBPROTOCOL, BeginUpload, PrepareObject

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # for the files, which the tests have
from tests.uploads.hostile import HOSTILE  # noqa: E402

CLOCK = SystemClock()
_PREPARING = 30.0  # s of a preparation that is seen


def open_desk(url: str) -> contextlib.AbstractContextManager[ClientConnection]:
    """A connection that may bring a file."""
    kinds = [Subprotocol(SUBPROTOCOL)]
    return connect(url, subprotocols=kinds, compression=None, proxy=None, max_size=2**22)


def begin(ws: ClientConnection, name: str, content: bytes, fraction: float = 1.0) -> None:
    """Send the file, or the first part of it."""
    ws.recv()
    ws.send(encode_control(BeginUpload(name=name, size=len(content))))
    for at in range(0, round(fraction * len(content)), CHUNK):
        ws.send(content[at : at + CHUNK])


def answer(ws: ClientConnection) -> str:
    """The last word of the server: what is in the file, or why not."""
    said = json.loads(ws.recv())
    return str(said.get("message") or f"examined, {said['triangles']:,} triangles")


def bring(url: str, name: str, content: bytes) -> str:
    """Bring one file, and hear what becomes of it."""
    with open_desk(url) as ws:
        begin(ws, name, content)
        return answer(ws)


def bring_slowly(url: str, _content: bytes) -> str:
    """A byte a second, until the server has had enough."""
    with open_desk(url) as ws:
        ws.recv()
        ws.send(encode_control(BeginUpload(name="slow.stl", size=10**6)))
        while True:
            try:
                return str(json.loads(ws.recv(timeout=1.0))["message"])
            except TimeoutError:
                ws.send(b"1")


def bring_at_once(url: str, content: bytes) -> str:
    """Twenty visitors, who send as fast as it goes whatever they are told."""
    said: list[str] = []
    with contextlib.ExitStack() as all_of_them:
        for _ in range(20):
            try:
                begin(all_of_them.enter_context(open_desk(url)), "many.ply", content, 0.9)
                said.append("could send")
            except ConnectionClosed as closed:
                said.append(closed.rcvd.reason if closed.rcvd else "closed")
    return "; ".join(f"{said.count(one)} {one}" for one in sorted(set(said)))


def go_in_the_middle(url: str, content: bytes) -> str:
    """Thirty visitors, one after another, who are gone before the file is there."""
    for _ in range(30):
        with open_desk(url) as ws, contextlib.suppress(ConnectionClosed):
            begin(ws, "gone.obj", content, 0.1)  # the rest never comes
    return "30 went"


def prepare(url: str, content: bytes) -> str:
    """A sound file, prepared for half a minute and then left."""
    with open_desk(url) as ws:
        begin(ws, "organ.ply", content)
        said = answer(ws)
        ws.recv()
        ws.send(encode_control(PrepareObject(fix="z < 15%", young=6e3)))
        until, phase = CLOCK.now() + _PREPARING, ""
        while CLOCK.now() < until and phase != "storing":
            phase = json.loads(ws.recv())["phase"]
    return f"{said}; prepared up to: {phase}"


VISITORS: dict[str, tuple[Callable[[str, bytes], str], str]] = {
    "slow": (bring_slowly, ""),
    "twenty at once": (bring_at_once, "five-million.ply"),
    "gone": (go_in_the_middle, "polygon.obj"),
    "prepared": (prepare, "organ.ply"),
}
NAMES = (*HOSTILE, *VISITORS)


def file_of(name: str, folder: Path) -> Path | None:
    """The file that a visitor brings, made where it is not there yet; making one takes seconds."""
    needed = name if name in HOSTILE else VISITORS[name][1]
    if not needed:
        return None
    path = folder / needed
    if not path.exists():
        made = HOSTILE.get(needed, (ROOT / "examples" / needed).read_bytes)
        path.write_bytes(made())
    return path


def main() -> None:
    """Be one visitor."""
    url, name, folder = sys.argv[1:]
    path = file_of(name, Path(folder))
    content = b"" if path is None else path.read_bytes()
    print(bring(url, name, content) if name in HOSTILE else VISITORS[name][0](url, content))


if __name__ == "__main__":
    main()
