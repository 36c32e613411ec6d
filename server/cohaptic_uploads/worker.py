"""The process that reads and prepares one file that came.

It is started as `python -m cohaptic_uploads.worker LIMITS` by `process.py`. It limits itself
first, then takes the file from its standard input, answers with what is in it, and on request
prepares it into the store; where what was chosen does not fit, it says so and waits for another
choice. It ends when its input does. Standard output belongs to the messages:
whatever a library prints goes nowhere.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

from cohaptic.clock import SystemClock
from cohaptic.errors import CohapticError, HeldError, SettingError, one_line
from cohaptic_server.objects.store.cache import UnkeptError, insist
from cohaptic_server.objects.unreadable import damaged
from cohaptic_server.touchable import kind_of
from cohaptic_uploads.confine import confine
from cohaptic_uploads.kept_files import MARK, give_up, keep
from cohaptic_uploads.limits import SIZE
from cohaptic_uploads.pipe import DATA, PipeEnded, fields_of, receive, send, send_text

if TYPE_CHECKING:
    from cohaptic_uploads.examine import Preview

T = TypeVar("T")
_TELL_EVERY = 0.2  # s between two words on the same phase
_READABLE = 100  # characters of a rule
_LONGEST = 1500  # characters of an error
_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))  # Windows has no quota


def main() -> None:
    """Serve one upload, with the limits that the command line says as JSON."""
    limits: dict[str, Any] = json.loads(sys.argv[1])
    tempfile.tempdir = limits["folder"]  # of this upload, which the server removes
    confine(limits["memory"], limits["cpu"], limits["memory"])
    insist()
    incoming, outgoing = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    try:
        _serve(incoming, outgoing, limits)
    except PipeEnded:
        pass  # the server has no more use for this process
    except (OSError, UnkeptError) as error:
        with contextlib.suppress(PipeEnded):
            send_text(outgoing, event="failed", about="file", why=_unkept(error))
    # Without the end of the interpreter, in which a thread of a library may wait for another.
    os._exit(0)


def _serve(incoming: IO[bytes], outgoing: IO[bytes], limits: dict[str, Any]) -> None:
    """Take the file, examine it, and prepare it once that is asked."""
    name = str(fields_of(receive(incoming)[1])["name"])
    content = _file(incoming)
    folder = Path(limits["folder"])
    path, mark = folder / f"object{kind_of(name)}", folder / MARK
    path.write_bytes(content)
    preview = _Step(outgoing, name, path).result(
        lambda: _examine(path, outgoing, limits["preview"])
    )
    path.unlink()
    # The server counts the choices, and ends this process.
    while preview is not None:
        wish = fields_of(receive(incoming)[1])
        # A painted region is a long rule, which nobody would read in an error.
        rule = str(wish["fix"])
        long_rule = repr(rule) if len(rule) > _READABLE else ""
        kept = keep(content, name, kind_of(name), mark)
        step = _Step(outgoing, name, kept, long_rule, event="refused")
        source = step.result(partial(_prepare, kept, wish, outgoing, limits, preview))
        if source is not None:
            mark.unlink(missing_ok=True)
            send_text(outgoing, event="prepared", source=source)
            return
        give_up(mark)
        if step.hopeless:
            return


def _file(incoming: IO[bytes]) -> bytes:
    """The pieces of the file, up to the empty one."""
    pieces: list[bytes] = []
    while True:
        kind, piece = receive(incoming)
        if kind != DATA:
            raise PipeEnded("no piece of a file")
        if not piece:
            return b"".join(pieces)
        pieces.append(piece)


def _examine(path: Path, outgoing: IO[bytes], triangles: int) -> Preview:
    # Only now, within the limits, are the readers imported.
    from cohaptic_uploads.examine import examine

    preview = examine(path, triangles)
    send_text(outgoing, event="examined", message=preview.examined.model_dump_json())
    send(outgoing, DATA, preview.surface.encode())
    return preview


def _prepare(
    path: Path,
    wish: dict[str, Any],
    outgoing: IO[bytes],
    limits: dict[str, Any],
    preview: Preview,
) -> dict[str, Any]:
    """Prepare it into the store; returns what it is, as options."""
    from cohaptic_server.bodies.solid.shape import SolidSettings
    from cohaptic_server.objects.auto.resolve import resolve
    from cohaptic_server.objects.build import build
    from cohaptic_server.objects.build_rubber import build_affordable
    from cohaptic_server.objects.demand import Demand
    from cohaptic_server.objects.object_file import ObjectFile
    from cohaptic_uploads.described import to_fields

    material = SolidSettings(float(wish["young"]), float(wish["poisson"]))
    scale = wish.get("scale") or preview.examined.scale
    preview.check_scale(scale)
    source = ObjectFile(
        path, str(wish["fix"]), scale=scale, material=material, max_memory=limits["budget"]
    )
    tell, rubber = _teller(outgoing), limits["rubber"]
    if rubber is None:
        source = resolve(source, tell, scale_given=True).source
        build(source, tell)
    else:
        demand, damping = Demand(hz=1.0 / rubber["period"], nonlinear=True), rubber["damping"]
        source = resolve(source, tell, scale_given=True, demand=demand).source
        source, _ = build_affordable(source, demand=demand, damping=damping, progress=tell)
    return to_fields(source)


class _Step:
    """Runs a part of the work, and makes one sentence of whatever ends it.

    Args:
        outgoing: Where the sentence goes.
        name: Name of the file, in the sentence.
        path: That the error says in its place.
        painted: Rule that is too long to be said; empty without one.
        event: What an error is that the visitor can do something about.

    Attributes:
        hopeless: Whether it ended in one that nobody can.
    """

    def __init__(
        self,
        outgoing: IO[bytes],
        name: str,
        path: Path,
        painted: str = "",
        event: str = "failed",
    ) -> None:
        self.hopeless = True
        self._event = event
        self._outgoing = outgoing
        self._name = one_line(name, 80)
        self._path = str(path)
        self._painted = painted

    def result(self, work: Callable[[], T]) -> T | None:
        """Do it; returns its result, or None where it came to nothing."""
        event, about = "failed", "file"
        try:
            return work()
        except (PipeEnded, UnkeptError):
            raise
        except MemoryError:
            why = "it takes more memory than an upload may have here"
        except RecursionError:
            why = "its parts lie too deep in each other to be read"
        except CohapticError as error:
            event, self.hopeless = self._event, self._event == "failed"
            about, why = _choice_of(error)
        except Exception as error:  # of a disk, or of a library, which did not foresee this file
            if isinstance(error, OSError) and error.errno in _FULL:
                raise
            why = f"it cannot be read: {damaged(error)}"
        said = why.replace(f"{self._path}: ", "").replace(self._path, self._name)
        if self._painted:
            said = said.replace(self._painted, "what was painted")
        if about == "file":
            said = f"{self._name}: {said}"
        send_text(self._outgoing, event=event, about=about, why=said[:_LONGEST])
        return None


def _unkept(error: OSError | UnkeptError) -> str:
    """Why a file that came, or what was made of it, is nowhere; no path of this machine is told."""
    if isinstance(error, UnkeptError):
        return str(error)
    # Where nothing can be written into a folder, the library says that there is none.
    is_full = error.errno in _FULL or isinstance(error, FileNotFoundError)
    why = os.strerror(errno.ENOSPC) if is_full else error.strerror or type(error).__name__
    return f"this server cannot keep the file: {why}"


def _choice_of(error: CohapticError) -> tuple[str, str]:
    """Which of a visitor's choices an error is about, and the error in words for one."""
    if isinstance(error, SettingError) and error.name == "--fix":
        return "held", f"what is held does not fit: it must be {error.limit}"
    if isinstance(error, SettingError) and error.name == SIZE:
        return "size", str(error)
    return ("held" if isinstance(error, HeldError) else "file"), str(error)


def _teller(outgoing: IO[bytes]) -> Callable[[str, float], None]:
    """A progress that goes out when the phase changes, and now and then within one."""
    clock = SystemClock()
    last = ("", 0.0)

    def tell(phase: str, share: float) -> None:
        nonlocal last
        now = clock.now()
        if phase == last[0] and now - last[1] < _TELL_EVERY:
            return
        last = (phase, now)
        send_text(outgoing, event="progress", phase=phase, share=min(1.0, max(0.0, share)))

    return tell


if __name__ == "__main__":
    main()
