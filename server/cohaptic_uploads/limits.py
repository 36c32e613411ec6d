"""Limits of an upload: bytes, memory, time."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import SettingError

SIZE = "the size"  # name of an object's size in errors


@dataclass(frozen=True, slots=True)
class UploadLimits:
    """Limits of one upload; there is one at a time.

    Args:
        file: Size of the file [bytes].
        memory: Memory of the process that reads and prepares the file [bytes]. On Linux the whole
            address space counts, of which its libraries take 0.3 GB.
        receive: Time for the file to arrive [s].
        examine: Time to read and examine the file [s].
        decide: Time for the visitor to choose, in all tries together [s].
        prepare: Time for one preparation [s].
        disk: Disk space of all uploads of this user on this machine, each counted with at least
            `file`; a new upload that could exceed it is refused [bytes].
        preview: Triangles of the surface that is shown before the preparation.
        tries: Number of times that the visitor may choose.

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
        """Memory that a preparation is planned for [bytes]; the rest covers errors of estimates."""
        return 0.65 * self.memory


def in_words(limits: UploadLimits) -> str:
    """Sentence for the owner of a server that allows uploads."""
    return (
        "a page of this machine may bring a mesh: one at a time, up to"
        f" {limits.file / 2**20:g} MiB, {limits.memory / 1e9:g} GB and {limits.prepare:g} s, in a"
        " process of its own"
    )
