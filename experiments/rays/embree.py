"""Rays against a mesh by Embree, on as many processes as it is told: the rate that `main.rs` beside this file asks for.

python embree.py FOLDER PROCESSES   (pip install numpy embreex)

FOLDER holds positions.f32 [vertices][3], triangles.u32 [triangles][3], origins.f32 [points][3], normals.f32 [points][3];
from each point go RAYS rays, cosine-distributed about its normal. Prints `any SECONDS` and `nearest SECONDS`: the least
of five, of the slowest process. Rays are made, and the tree built, before the clock starts.
"""
import multiprocessing as mp
import pathlib
import sys
import time

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

RAYS = 256
BATCH = 64  # points a call: what a caller of Embree in Python would hand over at a time


def load(folder, name, kind):
    return np.fromfile(folder / name, kind).reshape(-1, 3)


def rays(normals, seed):
    """Cosine-distributed directions, [points * RAYS][3]."""
    random = np.random.default_rng(seed)
    u, v = random.random((2, len(normals), RAYS))
    r, phi = np.sqrt(u), 2 * np.pi * v
    side = np.where(np.abs(normals[:, :1]) > 0.5, [[0, 1, 0]], [[1, 0, 0]])
    t = np.cross(normals, side)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    b = np.cross(normals, t)
    local = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u)], -1)
    return (local[..., :1] * t[:, None] + local[..., 1:2] * b[:, None] + local[..., 2:] * normals[:, None]).astype(np.float32)


def work(folder, share, of, barrier, out):
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, load(folder, "positions.f32", np.float32)[load(folder, "triangles.u32", np.uint32)])
    origins, normals = (load(folder, f"{name}.f32", np.float32)[share::of] for name in ("origins", "normals"))
    directions = rays(normals, share)
    origins = np.repeat(origins, RAYS, 0).reshape(-1, RAYS, 3)
    for query, name in (("OCCLUDED", "any"), ("INTERSECT", "nearest")):
        for round_ in range(5):
            barrier.wait()
            start = time.perf_counter()
            for at in range(0, len(origins), BATCH):
                o, d = (x[at : at + BATCH].reshape(-1, 3) for x in (origins, directions))
                scene.run(o, d, query=query)
            out.put((name, round_, time.perf_counter() - start))
            barrier.wait()


def main():
    folder, count = pathlib.Path(sys.argv[1]), int(sys.argv[2])
    mp.set_start_method("spawn")
    barrier, out = mp.Barrier(count), mp.Queue()
    workers = [mp.Process(target=work, args=(folder, i, count, barrier, out)) for i in range(count)]
    for worker in workers:
        worker.start()
    slowest = {}
    for _ in range(10 * count):
        name, round_, seconds = out.get()
        slowest[name, round_] = max(seconds, slowest.get((name, round_), 0))
    for worker in workers:
        worker.join()
    for name in ("any", "nearest"):
        print(name, min(seconds for (of, _), seconds in slowest.items() if of == name))


if __name__ == "__main__":
    main()
