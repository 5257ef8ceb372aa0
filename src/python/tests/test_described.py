"""Dictionaries as scene files, and arrays as meshes, without the library."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from skinfit.described import toml
from skinfit.errors import ArrayError, SceneError
from skinfit.exr import plane
from skinfit.given import names
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


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"triangles": [[0.0, 1.0, 2.0]]}, "mesh: triangles: holds floating-point numbers .* Give integers"),
        ({"triangles": [[True, False, True]]}, "truth values"),
        ({"positions": [[0, 0, 0], [1, 0], [0, 2, 0]]}, "mesh: positions"),
        ({"positions": [[0, 0, "0"]] * 3}, "holds words"),
        ({"positions": [[0, 0, 1j]] * 3}, "complex numbers"),
        ({"positions": [[0, 0, 0], [0, np.inf, 0], [0, 0, 0]]}, r"positions\[1, 1\]: inf is not finite"),
        ({"positions": [[0, 0, 0], [0, 0, 0], [1e39, 0, 0]]}, r"positions\[2, 0\]: 1e\+39 is beyond"),
        ({3: []}, "3 is no array"),
    ],
)
def test_numbers_that_are_no_mesh_are_refused(change: dict[Any, Any], words: str) -> None:
    with pytest.raises(ArrayError, match=words):
        glb({"positions": np.zeros((3, 3)), "triangles": [[0, 1, 2]], **change})


@pytest.mark.parametrize(
    "tables", [{"a": {"b": "\ud800"}}, {"a": {"\ud800": 1}}, {"a": {3: 1}}, {"a": {"b": b"x"}}, {"a": {"b": None}}]
)
def test_what_no_file_holds_is_refused(tables: dict[str, Any]) -> None:
    with pytest.raises(SceneError):
        toml(tables)


def test_one_name_is_a_list_of_one() -> None:
    assert names("side", SceneError) == ["side"] and names(iter(("a", "b")), SceneError) == ["a", "b"]
    for wrong in (3, [3], ["a", None], "\ud800"):
        with pytest.raises(SceneError):
            names(wrong, SceneError)  # type: ignore[arg-type]


def test_a_plane_is_an_openexr_file(tmp_path: Path) -> None:
    numbers = np.arange(6, dtype=np.float32).reshape(2, 3)
    (tmp_path / "a.exr").write_bytes(plane("haze.Y", numbers))
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as read:
        assert np.array_equal(read.channels()["haze.Y"].pixels, numbers)


def test_the_package_is_typed() -> None:
    import skinfit

    assert (Path(skinfit.__file__).parent / "py.typed").is_file()
