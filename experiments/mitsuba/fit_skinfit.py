"""The reflectance of a sphere, fitted to an image by skinfit: `fit_skinfit.py FOLDER` prints it as JSON."""

import json
import sys
import time
from pathlib import Path
from typing import Any

import skinfit


def scene_of(folder: Path, job: dict[str, Any], reflectance: list[float]) -> skinfit.Scene:
    view = {"name": "front", **job["camera"], "target": folder / "target.exr"}
    looks = {
        "mesh": {"file": folder / "sphere.glb"},
        "environment": {"file": folder / "light.exr"},
        # Its diffuse term alone: light that is prefiltered by the cosine, times base_weight.
        "model": {"effects": ["diffuse"], "params": {"base_weight": reflectance}},
        "view": [view],
        "fit": {"free": ["base_weight"], "loss": "l2"},
    }
    return skinfit.load_dict(looks, cache=False)


def main() -> None:
    folder = Path(sys.argv[1])
    job = json.loads((folder / "job.json").read_text())
    scene = scene_of(folder, job, job["start"])
    begun = time.perf_counter()
    found = scene.fit(engine="cpu")
    said = {"value": found.params["base_weight"], "steps": found.report["evaluations"]}
    # Of the fit, which reads and bakes anew and makes a report, the search alone.
    said["search"] = found.report["seconds"]["fit"]
    print(json.dumps({**said, "seconds": time.perf_counter() - begun}))


if __name__ == "__main__":
    main()
