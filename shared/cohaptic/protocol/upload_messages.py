"""Messages of a connection that uploads a mesh file to a server, as JSON text.

client -> server    begin_upload, the file as binary messages, prepare_object
server -> client    upload_offer, examined and a rest mesh, progress, refused, prepared; or error

Uploads have a subprotocol of their own, so that their changes leave the messages of clients that
touch or watch as they are.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from cohaptic.protocol.control.message import ControlMessage
from cohaptic.protocol.messages import Error, FileCoordinate, decode_text
from cohaptic.vec import ZERO

SUBPROTOCOL = "cohaptic.upload.v1"
CHUNK = 32 * 1024  # bytes of the file in one message
MAX_RULE = 16_384  # characters of a rule that says which part is held; painted regions are long
MAX_UPLOAD_TEXT = 24_576  # characters of the longest message, which holds such a rule
MAX_FINDINGS = 32
MIN_SCALE, MAX_SCALE = 1e-9, 1e9  # m in one unit of a file

Words = Annotated[str, Field(max_length=600)]


class UploadOffer(ControlMessage):
    """Files that the server accepts; the server's first message on the connection.

    Args:
        kinds: Suffixes of file names, with the dot.
        max_bytes: Largest size of a file.
        max_memory: Largest memory of the process that reads and prepares the file [bytes].
        max_seconds: Longest time of the preparation [s].
    """

    type: Literal["upload_offer"] = "upload_offer"
    kinds: tuple[str, ...]
    max_bytes: int
    max_memory: int
    max_seconds: float


class BeginUpload(ControlMessage):
    """Announce the file that follows in binary messages.

    Args:
        name: Name of the file, for people only: the server makes no path from it.
        size: Size of the file [bytes].
    """

    type: Literal["begin_upload"] = "begin_upload"
    name: str = Field(min_length=1, max_length=200)
    size: int = Field(ge=1, lt=2**40)


class Finding(ControlMessage):
    """A fault of the file, or something that could be better.

    Args:
        problem: Phrase that names the problem.
        remedy: Phrase that says what is done about the problem.
    """

    problem: Words
    remedy: Words


class Examined(ControlMessage):
    """Contents of the file; a rest mesh frame follows, simplified if it has many triangles.

    Args:
        findings: All findings on the file.
        fix: Rule for the part that the server proposes to hold fixed.
        scale: Proposed length of one unit of the file [m], with which the rest mesh is in metres.
        triangles: Triangles of the surface in the file.
        middle: Point of the file at which the rest mesh has its origin, at the proposed scale [m].
    """

    type: Literal["examined"] = "examined"
    findings: tuple[Finding, ...] = Field(max_length=MAX_FINDINGS)
    fix: str = Field(max_length=MAX_RULE)
    scale: float = Field(ge=MIN_SCALE, le=MAX_SCALE)
    triangles: int = Field(ge=1, lt=2**40)
    middle: tuple[FileCoordinate, FileCoordinate, FileCoordinate] = ZERO


class PrepareObject(ControlMessage):
    """Ask the server to make the object from the file.

    Args:
        fix: Rule that says which part is held fixed; its lengths are in metres at `scale`.
        scale: Length of one unit of the file [m]; None for the proposed scale.
        young: Young's modulus E [Pa]; None for one with which a press is felt.
        poisson: Poisson's ratio.
    """

    type: Literal["prepare_object"] = "prepare_object"
    fix: str = Field(min_length=1, max_length=MAX_RULE)
    scale: float | None = Field(default=None, ge=MIN_SCALE, le=MAX_SCALE)
    young: float | None = Field(default=None, ge=100.0, le=1e8)
    poisson: float = Field(default=0.45, ge=0.0, le=0.499)


class Progress(ControlMessage):
    """Progress of the preparation.

    Args:
        phase: Present phase in a word or two.
        share: Completed share of the phase, 0 to 1.
    """

    type: Literal["progress"] = "progress"
    phase: str = Field(max_length=80)
    share: float = Field(ge=0.0, le=1.0)


class Refused(ControlMessage):
    """The object cannot be made with these choices; the client may send `prepare_object` again.

    Args:
        about: Choice that does not fit; "file" if no single choice is at fault.
        message: Reason in one sentence.
        tries: Number of tries left.
    """

    type: Literal["refused"] = "refused"
    about: Literal["held", "size", "file"]
    message: str = Field(max_length=1600)
    tries: int = Field(ge=0, le=100)


class Prepared(ControlMessage):
    """The server now serves the object; earlier connections close with 4410 and may reconnect.

    Args:
        command: Command that serves the object again, with the visitor's own name of the file.
    """

    type: Literal["prepared"] = "prepared"
    command: str


UploadRequest = BeginUpload | PrepareObject
UploadAnswer = UploadOffer | Examined | Progress | Refused | Prepared | Error

_CLIENT: TypeAdapter[UploadRequest] = TypeAdapter(
    Annotated[UploadRequest, Field(discriminator="type")]
)
_SERVER: TypeAdapter[UploadAnswer] = TypeAdapter(
    Annotated[UploadAnswer, Field(discriminator="type")]
)


def decode_upload_request(text: str) -> UploadRequest:
    """Decode a client's message; raises RemoteProtocolError for any invalid text."""
    return decode_text(_CLIENT, text, MAX_UPLOAD_TEXT)


def decode_upload_answer(text: str) -> UploadAnswer:
    """Decode a server's message; raises RemoteProtocolError for any invalid text."""
    return decode_text(_SERVER, text, MAX_UPLOAD_TEXT)
