"""Limits of an upload: size of the file, memory, time and disk space."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import SettingError

SIZE = "the size"  # how errors call the size of an object


@dataclass(frozen=True, slots=True)
class UploadLimits:
    """Limits of one upload; a server runs one upload at a time.

    Args:
        file: Size of the file [bytes].
        memory: Memory of the process that reads and prepares the file [bytes]. On Linux the whole
            address space counts, including 0.3 GB for the libraries of the process.
        receive: Time for the file to arrive [s].
        examine: Time to read and examine the file [s].
        decide: Time for the visitor to choose options, in all tries together [s].
        prepare: Time for one preparation [s].
        disk: Disk space for all uploads of this system user on this machine [bytes]. Each upload
            counts at least `file`, and a new upload that could exceed the space is refused.
        preview: Number of triangles of the surface that the visitor sees before the preparation.
        tries: Number of times that the visitor may choose options.

    Raises:
        SettingError: A value is out of its range.
    """

    file: int = 32 * 2**20
    memory: int = 3 * 10**9
    receive: float = 60.0
    examine: float = 60.0
    decide: float = 600.0
    prepare: float = 300.0
    disk: int = 2**30
    preview: int = 12_000
    tries: int = 8

    def __post_init__(self) -> None:
        if not 2**10 <= self.file <= 2**30:
            raise SettingError("file of an upload", f"{self.file} bytes", "from 1 KiB to 1 GiB")
        if not 5 * 10**8 <= self.memory <= 10**12:
            raise SettingError("memory of an upload", f"{self.memory} bytes", "from 0.5 GB to 1 TB")
        if not self.file <= self.disk <= 2**40:
            limit = f"from {self.file} bytes, of one file, to 1 TiB"
            raise SettingError("disk of uploads", f"{self.disk} bytes", limit)
        for name in ("receive", "examine", "decide", "prepare"):
            if not 0.1 <= getattr(self, name) <= 86_400.0:
                raise SettingError(f"time to {name}", f"{getattr(self, name)} s", "0.1 s to a day")

    @property
    def budget(self) -> float:
        """Memory for which a preparation is planned [bytes]; the rest covers estimation errors."""
        return 0.65 * self.memory


def in_words(limits: UploadLimits) -> str:
    """Sentence that tells the owner of a server which uploads it allows."""
    return (
        "a page of this machine may bring a mesh: one at a time, up to"
        f" {limits.file / 2**20:g} MiB, {limits.memory / 1e9:g} GB and {limits.prepare:g} s, in a"
        " process of its own"
    )
