"""An image of one number a pixel as an OpenEXR file; those of colours are written by the library."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

_FLOAT = 2


def plane(channel: str, numbers: NDArray[np.float32]) -> bytes:
    """The bytes of a file with one channel of 32-bit floats, (height, width), uncompressed."""
    height, width = numbers.shape
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = channel.encode() + b"\0" + struct.pack("<iBxxxii", _FLOAT, 0, 1, 1) + b"\0"
    header = struct.pack("<II", 20000630, 2)
    header += b"".join(
        [
            _attribute("channels", "chlist", channels),
            _attribute("compression", "compression", b"\0"),
            _attribute("dataWindow", "box2i", window),
            _attribute("displayWindow", "box2i", window),
            _attribute("lineOrder", "lineOrder", b"\0"),
            _attribute("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
            _attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0.0, 0.0)),
            _attribute("screenWindowWidth", "float", struct.pack("<f", 1.0)),
            b"\0",
        ]
    )
    rows = [struct.pack("<ii", y, 4 * width) + row.astype("<f4").tobytes() for y, row in enumerate(numbers)]
    first = len(header) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * (8 + 4 * width) for y in range(height)))
    return header + offsets + b"".join(rows)


def _attribute(name: str, kind: str, content: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(content)) + content
