#!/usr/bin/env python3
"""skinfit beside Mitsuba 3 on one small job: lines of code and seconds.

    compare.py [-o results.json] [--folder FOLDER]

The job: a sphere in the light of a panorama, one view, and the reflectance of each channel to be found from its image.
`FOLDER` keeps what the programs are given: `job.json`, the sphere as glTF and as PLY with the same numbers, the panorama,
and the target, which Mitsuba has drawn with many samples.
"""

import argparse
import ast
import io
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
import tokenize
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path
from typing import Any

import fit_mitsuba
import fit_skinfit
import mitsuba as mi
import numpy as np
from skinfit.mesh import glb

HERE = Path(__file__).resolve().parent
PROGRAMS = {
    "skinfit": "fit_skinfit.py",
    "Mitsuba 3, Adam": "fit_mitsuba.py",
    "Mitsuba 3, Gauss-Newton": "fit_mitsuba_newton.py",
}
REPEATED = 3
# Of the target: 1024 samples a pixel, in parts that fit into memory.
PARTS, SAMPLES = 4, 256

JOB: dict[str, Any] = {
    "camera": {
        "eye": [0.0, 0.5, 3.2],
        "look_at": [0.0, 0.0, 0.0],
        "up": [0.0, 1.0, 0.0],
        "fov_y_degrees": 40.0,
        "width": 256,
        "height": 256,
    },
    "truth": [0.75, 0.5, 0.35],
    "start": [0.2, 0.2, 0.2],
    "tolerance": 1e-3,
}


def sphere(rings: int = 64, sectors: int = 128) -> dict[str, Any]:
    """A sphere of radius 1: convex, so that nothing stands in the light's way."""
    v, u = np.meshgrid(np.linspace(0, 1, rings + 1), np.linspace(0, 1, sectors + 1), indexing="ij")
    polar, around = np.pi * v, 2 * np.pi * u
    places = np.stack([np.sin(polar) * np.sin(around), np.cos(polar), np.sin(polar) * np.cos(around)], axis=-1)
    positions = places.reshape(-1, 3)
    corner = (np.arange(rings)[:, None] * (sectors + 1) + np.arange(sectors)).reshape(-1, 1)
    triangles = np.concatenate([corner + [0, sectors + 1, 1], corner + [1, sectors + 1, sectors + 2]])
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    # At the poles every other one has no area.
    triangles = triangles[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9]
    uvs = np.stack([u, v], axis=-1).reshape(-1, 2)
    return {"positions": positions, "normals": positions, "uvs": uvs, "triangles": triangles}


def panorama(height: int = 512) -> Any:
    """A sky with one soft bright spot, (height, 2 height, 3). So many rows that it hardly matters whether the first is at
    the pole (Mitsuba) or half a row below it (skinfit)."""
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(2 * height) + 0.5) / (2 * height), indexing="ij")
    polar, around = np.pi * v, 2 * np.pi * (u - 0.5)
    direction = np.stack([np.sin(polar) * np.sin(around), np.cos(polar), -np.sin(polar) * np.cos(around)], axis=-1)
    spot = np.array([0.6, 0.5, 0.62])
    bright = np.exp(20 * (direction @ (spot / np.linalg.norm(spot)) - 1))
    sky = 0.3 + direction[..., 1:2] * [0.05, 0.1, 0.2]
    return (sky + 8 * bright[..., None] * [1.0, 0.9, 0.7]).astype(np.float32)


def make(folder: Path) -> Any:
    """Write what the programs are given; the target."""
    (folder / "job.json").write_text(json.dumps(JOB))
    mi.Bitmap(panorama()).write(str(folder / "light.exr"))
    mesh = sphere()
    (folder / "sphere.glb").write_bytes(glb(mesh))
    plain = mi.Mesh("sphere", len(mesh["positions"]), len(mesh["triangles"]), has_vertex_normals=True)
    arrays = mi.traverse(plain)
    arrays["vertex_positions"] = mesh["positions"].ravel().astype(np.float32)
    arrays["vertex_normals"] = mesh["normals"].ravel().astype(np.float32)
    arrays["faces"] = mesh["triangles"].ravel().astype(np.uint32)
    arrays.update()
    plain.write_ply(str(folder / "sphere.ply"))
    scene = fit_mitsuba.scene_of(folder, JOB, JOB["truth"])
    integrator = mi.load_dict({"type": "direct", "hide_emitters": True})
    parts = [np.array(mi.render(scene, integrator=integrator, spp=SAMPLES, seed=seed)) for seed in range(PARTS)]
    target = np.mean(parts, axis=0)
    mi.Bitmap(target.astype(np.float32)).write(str(folder / "target.exr"))
    return target


def agreement(folder: Path, target: Any) -> dict[str, float]:
    """How far skinfit's image at the truth is from the target: PSNR in dB, of all pixels and of those that are wholly
    covered, and the ratio of their brightness."""
    drawn = fit_skinfit.scene_of(folder, JOB, JOB["truth"]).render().image
    off = drawn - target[:, :, :3]
    whole = target[:, :, 3] == 1.0
    return {
        "psnr": float(-10 * np.log10(np.mean(off**2))),
        "psnr_inside": float(-10 * np.log10(np.mean(off[whole] ** 2))),
        "brightness": float(drawn[whole].sum() / target[:, :, :3][whole].sum()),
    }


def lines(file: Path) -> int:
    """Lines with code: neither blank, nor comments, nor docstrings."""
    text = file.read_text()
    beside = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    counted: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in beside:
            counted.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            counted.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(counted)


def timed(program: str, folder: Path, home: Path) -> dict[str, Any]:
    """Run a program in a process of its own: what it prints, and the seconds of the whole, by the clock and of processors."""
    environment = {**os.environ, "HOME": str(home), "SKINFIT_CACHE": str(home / "skinfit")}
    begun, worked = time.perf_counter(), of_processors()
    run = subprocess.run(
        [sys.executable, HERE / program, folder], env=environment, check=True, capture_output=True, text=True
    )
    seconds = time.perf_counter() - begun
    return {**json.loads(run.stdout), "whole": seconds, "worked": of_processors() - worked}


def of_processors() -> float:
    """Seconds that processors have spent on processes that have ended: what others do meanwhile hardly counts."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def measure(folder: Path) -> dict[str, Any]:
    """All that is compared."""
    raw: dict[str, Any] = {"agreement": agreement(folder, make(folder)), "tolerance": JOB["tolerance"], "rows": []}
    for name, program in PROGRAMS.items():
        with tempfile.TemporaryDirectory() as home:
            # Mitsuba keeps what it has compiled in the home folder: the first run has to compile.
            first, *others = (timed(program, folder, Path(home)) for _ in range(1 + REPEATED))
        raw["rows"].append(
            {
                "name": name,
                "program": program,
                "lines": lines(HERE / program),
                "error": float(np.abs(np.array(first["value"]) - JOB["truth"]).max()),
                "steps": first["steps"],
                "first": first["whole"],
                "whole": min(run["whole"] for run in others),
                "worked": min(run["worked"] for run in others),
                "fit": min(run["seconds"] for run in others),
                "search": min(run.get("search", run["seconds"]) for run in others),
            }
        )
        print(raw["rows"][-1], file=sys.stderr)
    return raw


def head() -> dict[str, Any]:
    """Which command, of which commit, on what day and machine."""

    def git(*words: str) -> str:
        return subprocess.run(["git", "-C", HERE, *words], check=True, capture_output=True, text=True).stdout.strip()

    processor = re.search(r"^model name\s*: (.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    # As experiments/figures has it: what measures and is measured, without raw files and pages.
    sources = ["src", "experiments", "Cargo.lock", ":!*.json", ":!*.md", ":!*.svg"]
    changes = git("status", "--porcelain", "--", *[f":/{place}" if place[0] != ":" else place for place in sources])
    return {
        "command": "python experiments/mitsuba/compare.py",
        "commit": git("rev-parse", "--short", "HEAD") + (" with changes" if changes else ""),
        "date": datetime.now(timezone.utc).date().isoformat(),
        "machine": {
            "processor": processor[1] if processor else "unknown",
            "cores": len(os.sched_getaffinity(0)),
            "load": others(),
        },
        "versions": {name: version(name) for name in ("skinfit", "mitsuba", "drjit", "numpy")},
    }


def others() -> int:
    """How many threads of others want to run: the largest of some looks."""
    looks = []
    for _ in range(5):
        looks.append(int(re.search(r"procs_running (\d+)", Path("/proc/stat").read_text())[1]) - 1)  # type: ignore[index]
        time.sleep(0.2)
    return max(looks)


def main() -> None:
    words = argparse.ArgumentParser(description="skinfit beside Mitsuba 3: lines of code and seconds")
    words.add_argument("-o", "--output", type=Path, default=HERE / "results.json", help="the raw file to write")
    words.add_argument("--folder", type=Path, help="keep what the programs are given there")
    given = words.parse_args()
    top = head()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        raw = {"head": top, **measure(folder)}
    given.output.write_text(json.dumps(raw, indent=2) + "\n")


if __name__ == "__main__":
    main()
