"""A mesh of arrays as a binary glTF 2.0 file, which a scene names."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import ArrayError
from .given import Number, numbers

_FLOAT, _UNSIGNED = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
# What is a number each of a vertex: its name in glTF, how many, and whether it has to be there.
_ATTRIBUTES = {"positions": ("POSITION", 3, True), "normals": ("NORMAL", 3, False), "uvs": ("TEXCOORD_0", 2, False)}


def glb(mesh: Mapping[str, Any]) -> bytes:
    """The file's bytes. Raises `ArrayError` where an array is missing, unknown, or of another shape."""
    unknown = sorted(map(str, set(mesh) - {"triangles", *_ATTRIBUTES}))
    if unknown:
        raise ArrayError(f"mesh: {', '.join(unknown)} is no array of a mesh. Give {', '.join(_ATTRIBUTES)}, triangles.")
    buffer = _Buffer()
    attributes = {}
    count = len(_rows("positions", mesh.get("positions"), 3, np.float32))
    for name, (semantic, width, required) in _ATTRIBUTES.items():
        if required or mesh.get(name) is not None:
            rows = _rows(name, mesh[name], width, np.float32)
            if len(rows) != count:
                raise ArrayError(f"mesh: {len(rows)} {name} for {count} positions. Give one for each.")
            attributes[semantic] = buffer.add(rows, _VERTICES)
    triangles = _rows("triangles", mesh.get("triangles"), 3, np.int64)
    if triangles.size and not (0 <= triangles.min() and triangles.max() < count):
        raise ArrayError(f"mesh: triangles name vertices beyond the {count} that there are. Count them from 0.")
    indices = buffer.add(triangles.astype(np.uint32).reshape(-1), _INDICES)
    return buffer.file({"attributes": attributes, "indices": indices})


def _rows(name: str, value: Any, width: int, kind: type[Number]) -> NDArray[Number]:
    if value is None:
        raise ArrayError(f"mesh: there are no {name}. Give an array of (n, {width}).")
    whole = np.issubdtype(kind, np.integer)
    remedy = f"Give {'integers' if whole else 'finite numbers'} as an array of (n, {width})."
    taken = numbers(f"mesh: {name}", value, kind, remedy, kinds="iu" if whole else "fiu")
    if taken.ndim != 2 or taken.shape[1] != width:
        raise ArrayError(f"mesh: {name} of shape {taken.shape}. {remedy}")
    return taken


class _Buffer:
    """Numbers one after another, with what glTF says of each array."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []

    def add(self, numbers: NDArray[Any], target: int) -> int:
        """The number of the accessor."""
        plain = numbers.astype(numbers.dtype.newbyteorder("<")).tobytes()
        self._views.append(
            {"buffer": 0, "byteOffset": len(self._bytes), "byteLength": len(plain), "target": target}
        )
        kind = "SCALAR" if numbers.ndim == 1 else f"VEC{numbers.shape[1]}"
        component = _UNSIGNED if target == _INDICES else _FLOAT
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": component,
            "count": int(numbers.shape[0]),
            "type": kind,
        }
        if kind == "VEC3" and len(numbers):
            accessor |= {"min": numbers.min(axis=0).tolist(), "max": numbers.max(axis=0).tolist()}
        self._accessors.append(accessor)
        self._bytes += plain
        return len(self._accessors) - 1

    def file(self, primitive: dict[str, Any]) -> bytes:
        """The whole file, with one mesh of this primitive."""
        document = {
            "asset": {"version": "2.0", "generator": "skinfit"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [primitive]}],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._bytes)}],
        }
        text = json.dumps(document, allow_nan=False).encode()
        chunks = [_chunk(b"JSON", text, b" "), _chunk(b"BIN\0", bytes(self._bytes), b"\0")]
        length = 12 + sum(map(len, chunks))
        return struct.pack("<4sII", b"glTF", 2, length) + b"".join(chunks)


def _chunk(kind: bytes, content: bytes, padding: bytes) -> bytes:
    content += padding * (-len(content) % 4)
    return struct.pack("<I4s", len(content), kind) + content
