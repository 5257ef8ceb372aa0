"""The reflectance of a sphere, fitted to an image by Mitsuba 3 and Adam: `fit_mitsuba.py FOLDER` prints it as JSON."""

import json
import sys
import time
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")

# Of 1, 4 and 16 samples a pixel and steps of 0.02, 0.05, 0.1 and 0.2 these come within the tolerance soonest, or nearly.
SAMPLES, STEP, MOST = 1, 0.05, 2000
KEY = "sphere.bsdf.reflectance.value"


def scene_of(folder: Path, job: dict[str, Any], reflectance: list[float]) -> Any:
    camera = job["camera"]
    film = {
        "type": "hdrfilm",
        "width": camera["width"],
        "height": camera["height"],
        "pixel_format": "rgba",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    looks = {
        "type": "scene",
        # Samples of the light alone are the cheapest here, as the sphere is diffuse.
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": True},
        "light": {
            "type": "envmap",
            "filename": str(folder / "light.exr"),
            # Its panorama begins where skinfit's has its middle.
            "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 180),
        },
        "sphere": {
            "type": "ply",
            "filename": str(folder / "sphere.ply"),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": reflectance}},
        },
        "sensor": {
            "type": "perspective",
            "fov": camera["fov_y_degrees"],
            "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(camera["eye"], camera["look_at"], camera["up"]),
            "sampler": {"type": "multijitter"},
            "film": film,
        },
    }
    return mi.load_dict(looks)


def main() -> None:
    folder = Path(sys.argv[1])
    job = json.loads((folder / "job.json").read_text())
    scene = scene_of(folder, job, job["start"])
    target = mi.TensorXf(mi.Bitmap(str(folder / "target.exr")))
    truth = mi.Color3f(job["truth"])
    params = mi.traverse(scene)
    begun = time.perf_counter()
    optimizer = mi.ad.Adam(lr=STEP)
    optimizer[KEY] = mi.Color3f(params[KEY])
    for step in range(MOST):
        params.update(optimizer)
        image = mi.render(scene, params, spp=SAMPLES, seed=step)
        dr.backward(dr.mean(dr.square(image - target), axis=None))
        optimizer.step()
        optimizer[KEY] = dr.clip(optimizer[KEY], 0.0, 1.0)
        # It is told when it is good enough: of noisy images it cannot know.
        if dr.max(dr.abs(optimizer[KEY] - truth))[0] < job["tolerance"]:
            break
    said = {"value": [float(x[0]) for x in optimizer[KEY]], "steps": step + 1}
    print(json.dumps({**said, "seconds": time.perf_counter() - begun}))


if __name__ == "__main__":
    main()
