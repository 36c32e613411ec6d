"""The worker process, which reads and prepares one uploaded file.

`process.py` starts the worker as `python -m cohaptic_uploads.worker LIMITS`. The worker first
limits its own resources, then takes the file from standard input, answers with its findings, and on
request prepares the object and stores it in the cache. If the visitor's choice does not fit, the
worker reports the reason and waits for another choice. The worker ends when its input ends.
Standard output is reserved for messages, so that the output of libraries is discarded.
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
from cohaptic_server.objects.memory_limit import damaged
from cohaptic_server.objects.store.cache import UnkeptError, insisting
from cohaptic_server.touchable import kind_of
from cohaptic_uploads.confine import confine
from cohaptic_uploads.kept_files import MARK, give_up, keep
from cohaptic_uploads.limits import SIZE
from cohaptic_uploads.pipe import DATA, PipeEnded, fields_of, receive, send, send_text

if TYPE_CHECKING:
    from cohaptic_uploads.examine import Preview

T = TypeVar("T")
_TELL_EVERY = 0.2  # s between two progress messages on the same phase
_READABLE = 100  # characters; an error does not quote a longer rule for the held region
_LONGEST = 1500  # characters of an error
_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))  # Windows has no quota


def main() -> None:
    """Serve one upload, with the limits given as JSON on the command line."""
    limits: dict[str, Any] = json.loads(sys.argv[1])
    tempfile.tempdir = limits["folder"]  # the folder of this upload, which the server removes
    confine(limits["memory"], limits["cpu"], limits["memory"])
    incoming, outgoing = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    try:
        with insisting():
            _serve(incoming, outgoing, limits)
    except PipeEnded:
        pass  # the server no longer needs this process
    except (OSError, UnkeptError) as error:
        with contextlib.suppress(PipeEnded):
            send_text(outgoing, event="failed", about="file", why=_unkept(error))
    # Exit without finalising the interpreter, in which threads of libraries may block each other.
    os._exit(0)


def _serve(incoming: IO[bytes], outgoing: IO[bytes], limits: dict[str, Any]) -> None:
    """Take the file, examine it, and prepare it on request."""
    name = str(fields_of(receive(incoming)[1])["name"])
    content = _file(incoming)
    folder = Path(limits["folder"])
    path, mark = folder / f"object{kind_of(name)}", folder / MARK
    path.write_bytes(content)
    preview = _Step(outgoing, name, path).result(
        lambda: _examine(path, outgoing, limits["preview"])
    )
    path.unlink()
    # The server counts the tries, and ends this process after the last.
    while preview is not None:
        wish = fields_of(receive(incoming)[1])
        # The rule for a painted region is too long to be readable in an error.
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
    """Receive the pieces of the file up to the empty one; returns the content of the file."""
    pieces: list[bytes] = []
    while True:
        kind, piece = receive(incoming)
        if kind != DATA:
            raise PipeEnded("no piece of a file")
        if not piece:
            return b"".join(pieces)
        pieces.append(piece)


def _examine(path: Path, outgoing: IO[bytes], triangles: int) -> Preview:
    # The readers are imported only now, so that the limits hold for them, too.
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
    """Prepare the object and store it in the cache; returns the options that describe it."""
    from cohaptic_server.objects.auto.resolve import resolve
    from cohaptic_server.objects.build import build
    from cohaptic_server.objects.build_rubber import build_affordable
    from cohaptic_server.objects.cost import Demand
    from cohaptic_server.objects.object_file import ObjectFile
    from cohaptic_uploads.described import to_fields

    wished = {name: value for name, value in wish.items() if value is not None}
    given = {"scale": preview.examined.scale, **wished}
    preview.check_scale(given["scale"])
    source = ObjectFile.of(path, given).changed({"max_memory": limits["budget"]})
    tell, rubber = _teller(outgoing), limits["rubber"]
    softness = "young" not in wished
    if rubber is None:
        source = resolve(source, tell, scale_given=True, softness=softness).source
        build(source, tell)
    else:
        demand, damping = Demand(hz=1.0 / rubber["period"], nonlinear=True), rubber["damping"]
        source = resolve(source, tell, scale_given=True, softness=softness, demand=demand).source
        source, _ = build_affordable(source, demand=demand, damping=damping, progress=tell)
    return to_fields(source)


class _Step:
    """Runs one step of the work; if an error ends it, sends a sentence about the error.

    Args:
        outgoing: Stream to which the sentence is written.
        name: Name of the visitor's file, for the sentence.
        path: Path of the file on this machine, which `name` replaces in the sentence.
        painted: Rule that is too long to be quoted in the sentence; empty without such a rule.
        event: Event to send for an error that another choice of the visitor may avoid.

    Attributes:
        hopeless: Whether the step ended with an error that no other choice can avoid.
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
        """Run `work`; returns its result, or None if it failed."""
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
        except Exception as error:  # from the disk, or from a library that cannot read this file
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
    """Reason why a file or its object cannot be stored, without any path of this machine."""
    if isinstance(error, UnkeptError):
        return str(error)
    # If no folder for temporary files is writable, `tempfile` raises FileNotFoundError.
    is_full = error.errno in _FULL or isinstance(error, FileNotFoundError)
    why = os.strerror(errno.ENOSPC) if is_full else error.strerror or type(error).__name__
    return f"this server cannot keep the file: {why}"


def _choice_of(error: CohapticError) -> tuple[str, str]:
    """Return the visitor's choice that an error concerns, and the error in words for a visitor."""
    if isinstance(error, SettingError) and error.name == "--fix":
        return "held", f"what is held does not fit: it must be {error.limit}"
    if isinstance(error, SettingError) and error.name == SIZE:
        return "size", str(error)
    return ("held" if isinstance(error, HeldError) else "file"), str(error)


def _teller(outgoing: IO[bytes]) -> Callable[[str, float], None]:
    """Make a progress callback that sends each new phase, and a share every `_TELL_EVERY`."""
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
