"""Writes `.vtu` files in every form of their arrays, from the specification.

meshio writes one piece, in little-endian base64 or text; other programs write many pieces, bytes
behind the XML, and the other order of bytes.
"""

from __future__ import annotations

import base64
import lzma
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

FORMS = ("ascii", "binary", "appended base64", "appended raw")
PACKERS: dict[str, Callable[[bytes], bytes]] = {
    "": bytes,
    "vtkZLibDataCompressor": zlib.compress,
    "vtkLZMADataCompressor": lzma.compress,
}
_NAMES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64", "u1": "UInt8"}
_BLOCK = 1000  # bytes of a packed block, few so that an array has several


@dataclass(frozen=True, eq=False)
class Piece:
    """One piece of a grid.

    Args:
        x: Points, shape (n, 3).
        cells: Points of each cell.
        types: VTK's type of each cell.
        data: Values of the cells by the name of their array.
    """

    x: npt.NDArray[np.float64]
    cells: Sequence[Sequence[int]]
    types: Sequence[int]
    data: dict[str, Any] = field(default_factory=dict[str, Any])


@dataclass
class VtuWriter:
    """Writes a file in one form.

    Args:
        form: One of `FORMS`.
        order: `<` or `>`.
        header: `u4` or `u8`, the type of the numbers before an array.
        packer: One of `PACKERS`.
    """

    form: str = "ascii"
    order: str = "<"
    header: str = "u4"
    packer: str = ""
    _behind: bytes = b""

    def written(self, pieces: Sequence[Piece]) -> bytes:
        """The bytes of a file with some pieces."""
        self._behind = b""
        body = b"".join(self._piece(piece) for piece in pieces)
        order = "LittleEndian" if self.order == "<" else "BigEndian"
        packer = f' compressor="{self.packer}"' if self.packer else ""
        head = (
            f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="2.2" byte_order='
            f'"{order}" header_type="UInt{8 * int(self.header[1])}"{packer}>\n<UnstructuredGrid>'
        )
        behind = b""
        if self.form.startswith("appended"):
            kind = self.form.removeprefix("appended ").encode()
            behind = b'\n<AppendedData encoding="%s">\n_' % kind
            behind += self._behind + b"\n</AppendedData>"
        return head.encode() + body + b"\n</UnstructuredGrid>" + behind + b"\n</VTKFile>\n"

    def _piece(self, piece: Piece) -> bytes:
        corners = [n for cell in piece.cells for n in cell]
        ends = np.cumsum([len(cell) for cell in piece.cells])
        data = [self._array(name, np.asarray(v), "f8") for name, v in piece.data.items()]
        counts = f'NumberOfPoints="{len(piece.x)}" NumberOfCells="{len(piece.types)}"'
        return b"".join([
            f"\n<Piece {counts}>".encode(),
            b"\n<CellData>", *data, b"\n</CellData>",
            b"\n<Points>", self._array("Points", piece.x, "f8"), b"\n</Points>",
            b"\n<Cells>", self._array("connectivity", np.array(corners), "i8"),
            self._array("offsets", ends, "i4"), self._array("types", np.array(piece.types), "u1"),
            b"\n</Cells>\n</Piece>",
        ])  # fmt: skip

    def _array(self, name: str, values: Any, kind: str) -> bytes:
        width = values.shape[1] if values.ndim > 1 else 1
        head = f'\n<DataArray type="{_NAMES[kind]}" Name="{name}" NumberOfComponents="{width}"'
        if self.form == "ascii":
            text = " ".join(f"{value!r}" for value in values.ravel().tolist())
            return f'{head} format="ascii">\n{text}\n</DataArray>'.encode()
        raw = self.form == "appended raw"
        block = self._block(values.astype(self.order + kind).tobytes(), raw=raw)
        if self.form == "binary":
            return f'{head} format="binary">\n'.encode() + block + b"\n</DataArray>"
        at = len(self._behind)
        self._behind += block
        return f'{head} format="appended" offset="{at}"/>'.encode()

    def _block(self, data: bytes, *, raw: bool) -> bytes:
        def numbers(*values: int) -> bytes:
            return np.array(values, dtype=self.order + self.header).tobytes()

        coded: Callable[[bytes], bytes] = bytes if raw else base64.b64encode
        if not self.packer:
            return coded(numbers(len(data)) + data)
        pack = PACKERS[self.packer]
        blocks = [data[at : at + _BLOCK] for at in range(0, len(data), _BLOCK)]
        packed = [pack(one) for one in blocks]
        last = len(data) % _BLOCK
        head = numbers(len(blocks), _BLOCK, last, *(len(one) for one in packed))
        return coded(head if blocks else numbers(0)) + coded(b"".join(packed))
