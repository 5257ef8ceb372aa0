"""Dictionaries as scene files, and arrays as meshes, without the library."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from skinfit.described import toml
from skinfit.errors import ArrayError
from skinfit.mesh import glb


def test_a_dictionary_is_written_as_a_scene_file() -> None:
    text = toml(
        {
            "mesh": {"file": 'a "b"\\c.glb', "time": 1.5},
            "view": [{"name": "front", "width": np.int64(3), "eye": np.zeros(3)}],
            "fit": {"gains": True, "free": ["a", "b"], "maps": {"color": {"lower": 0}}},
        }
    )
    assert text == (
        '[mesh]\nfile = "a \\"b\\"\\\\c.glb"\ntime = 1.5\n\n'
        '[[view]]\nname = "front"\nwidth = 3\neye = [0.0, 0.0, 0.0]\n\n'
        '[fit]\ngains = true\nfree = ["a", "b"]\nmaps = { color = { lower = 0 } }\n'
    )


def test_a_mesh_is_a_binary_gltf_file() -> None:
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], dtype=np.float64)
    file = glb({"positions": positions, "triangles": [[0, 1, 2]], "uvs": [[0, 0], [1, 0], [0, 1]]})
    magic, version, length = struct.unpack_from("<4sII", file)
    assert (magic, version, length) == (b"glTF", 2, len(file))
    size, kind = struct.unpack_from("<I4s", file, 12)
    assert kind == b"JSON" and size % 4 == 0
    document = json.loads(file[20 : 20 + size])
    first = document["accessors"][0]
    assert first["max"] == [1, 2, 0] and first["count"] == 3
    binary = file[20 + size + 8 :]
    assert np.array_equal(np.frombuffer(binary, np.float32, 9).reshape(3, 3), positions)
    indices = document["bufferViews"][document["meshes"][0]["primitives"][0]["indices"]]
    assert np.array_equal(np.frombuffer(binary, np.uint32, 3, indices["byteOffset"]), [0, 1, 2])


def test_a_mesh_without_positions_is_refused() -> None:
    with pytest.raises(ArrayError, match="there are no positions"):
        glb({"triangles": [[0, 1, 2]]})


def test_the_package_is_typed() -> None:
    import skinfit

    assert (Path(skinfit.__file__).parent / "py.typed").is_file()
