"""An image that was drawn, with what it is made of.

    >>> import numpy as np, skinfit
    >>> grey = skinfit.Rendering(image=np.full((2, 3, 3), 0.25, np.float32), alpha=np.ones((2, 3), np.float32))
    >>> grey.srgb(exposure=1.0)[0, 0].tolist()
    [188, 188, 188]
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Rendering:
    """A view, row by row from the top, in linear Rec.709 radiance, premultiplied by coverage."""

    image: NDArray[np.float32]
    """(height, width, 3)."""
    alpha: NDArray[np.float32]
    """(height, width): the share of each pixel that the mesh covers, in [0, 1]."""
    layers: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    """By name, each (height, width, 3): a layer for each term, `plain` for what is not skin, `background` for what stands
    behind. They add up to the image without its bloom. Empty unless terms were asked for."""
    haze: NDArray[np.float32] | None = None
    """(height, width), premultiplied; `None` unless terms were asked for and an effect makes it."""

    def srgb(self, exposure: float = 0.0) -> NDArray[np.uint8]:
        """(height, width, 3) codes for a screen: brightened by `exposure` stops, clipped, sRGB's curve, on black."""
        return srgb(self.image.astype(np.float64) * 2.0**exposure)

    def _repr_png_(self) -> bytes:
        """What a notebook shows: the image as `srgb` has it."""
        codes = self.srgb()
        height, width, _ = codes.shape
        # Each row begins with the filter that it is stored by: none.
        rows = np.concatenate([np.zeros((height, 1), np.uint8), codes.reshape(height, 3 * width)], axis=1)
        header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
        chunks = [(b"IHDR", header), (b"sRGB", b"\0"), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b"")]
        return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, content) for kind, content in chunks)


def srgb(linear: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Codes of linear light, clipped to [0, 1], by sRGB's curve."""
    clipped = np.clip(linear, 0.0, 1.0)
    curved = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    codes: NDArray[np.uint8] = np.round(255.0 * curved).astype(np.uint8)
    return codes


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
