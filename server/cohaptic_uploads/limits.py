"""How much an upload may take: bytes, memory, time."""

from __future__ import annotations

from dataclasses import dataclass

from cohaptic.errors import SettingError

SIZE = "the size"  # of an object, as an error names it


@dataclass(frozen=True, slots=True)
class UploadLimits:
    """Limits of one upload; there is one at a time.

    Args:
        file: Size of the file [bytes].
        memory: Memory of the process that reads and prepares it [bytes]. On Linux all address space
            counts, of which its libraries have 0.3 GB.
        receive: For the file to come [s].
        examine: For it to be read and looked at [s].
        decide: For the visitor to choose, in all tries together [s].
        prepare: For the preparation [s].
        disk: Below which all uploads of this user on this machine have to be, as far as each may
            still come, for another to begin [bytes].
        preview: Triangles of the surface that is shown before.
        tries: How often the visitor may choose.

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
        """Memory that a preparation is planned for [bytes]; the rest is for errors of the plan."""
        return 0.65 * self.memory


def in_words(limits: UploadLimits) -> str:
    """What an owner is told who allows uploads."""
    return (
        "a page of this machine may bring a mesh: one at a time, up to"
        f" {limits.file / 2**20:g} MiB, {limits.memory / 1e9:g} GB and {limits.prepare:g} s, in a"
        " process of its own"
    )
