"""Normals of a detailed mesh, against Blender: Cycles' bake "selected to active" on the same meshes.

A wavy surface of 524 288 triangles onto a square, and a bumpy ball of as many onto a plainer ball, at
1024 x 1024 texels, one sample a texel, in turns and best of several. On both sides the meshes are there
already, with their smooth normals; what is timed is all the rest, the building of the ray-tracing
structure included: `bw.bake(plain, "normal", detail=...)`, from meshes to a NumPy array, and
`bpy.ops.object.bake`, into an image of floats. Errors are angles to the normal of the formula that the
detailed mesh was made from, at the texels away from the border and the poles.
"""

# requires: bpy==5.0.1 numpy pillow

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

os.environ.setdefault("RAYON_NUM_THREADS", str(len(os.sched_getaffinity(0))))

import bpy
import numpy as np

import bumpwgpu as bw

# The poles of a ball have no area on the map, and Blender's next release wants one line less.
warnings.simplefilter("ignore")

SIZE = 1024
THREADS = int(os.environ["RAYON_NUM_THREADS"])


class Arrays(NamedTuple):
    """A mesh: positions, triangles, UVs with v down, and normals or None."""

    positions: np.ndarray
    indices: np.ndarray
    uvs: np.ndarray

    def ours(self) -> bw.Mesh:
        return bw.Mesh(self.positions, self.indices, self.uvs)

    def blenders(self, name: str) -> bpy.types.Object:
        mesh = bpy.data.meshes.new(name)
        mesh.vertices.add(len(self.positions))
        mesh.vertices.foreach_set("co", self.positions.astype(np.float32).ravel())
        mesh.loops.add(self.indices.size)
        mesh.loops.foreach_set("vertex_index", self.indices.astype(np.int32).ravel())
        mesh.polygons.add(len(self.indices))
        mesh.polygons.foreach_set("loop_start", np.arange(0, self.indices.size, 3, dtype=np.int32))
        mesh.update(calc_edges=True)
        mesh.polygons.foreach_set("use_smooth", np.ones(len(self.indices), bool))
        flipped = self.uvs * (1, -1) + (0, 1)
        layer = mesh.uv_layers.new(name="UV")
        layer.data.foreach_set("uv", flipped[self.indices.ravel()].astype(np.float32).ravel())
        mesh.update()
        thing = bpy.data.objects.new(name, mesh)
        bpy.context.collection.objects.link(thing)
        return thing


class Case(NamedTuple):
    """Two meshes, the rays' reach, and the normals of the formula at a map's texels (NaN: not judged)."""

    name: str
    plain: Arrays
    detail: Arrays
    reach: float
    space: str
    expected: np.ndarray


def grid(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """u and v of a grid's corners, row by row from the top, and its triangles."""
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    first = np.arange((columns + 1) * rows).reshape(rows, columns + 1)[:, :columns].ravel()
    below = first + columns + 1
    triangles = np.concatenate(
        [np.stack([first, below, below + 1], 1), np.stack([first, below + 1, first + 1], 1)]
    )
    return u.ravel(), v.ravel(), triangles


def texels() -> tuple[np.ndarray, np.ndarray]:
    centres = (np.arange(SIZE) + 0.5) / SIZE
    u, v = np.meshgrid(centres, centres)
    return u, v


def unit(vectors: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def waves() -> Case:
    """z = 0.03 sin(37 x) cos(29 y) over the unit square; tangent space is the space of the square."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        x, y = u, 1 - v
        return np.stack([x, y, 0.03 * np.sin(37 * x) * np.cos(29 * y)], axis=-1)

    u, v, triangles = grid(512, 512)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    square = np.column_stack([corners[:, 0], 1 - corners[:, 1], np.zeros(4)])
    u_at, v_at = texels()
    x, y = u_at, 1 - v_at
    slope_x = 0.03 * 37 * np.cos(37 * x) * np.cos(29 * y)
    slope_y = -0.03 * 29 * np.sin(37 * x) * np.sin(29 * y)
    expected = unit(np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=-1))
    inside = (abs(u_at - 0.5) < 0.495) & (abs(v_at - 0.5) < 0.495)
    expected[~inside] = np.nan
    plain = Arrays(square, np.array([[0, 3, 2], [0, 2, 1]]), corners)
    detail = Arrays(place(u, v), triangles, np.column_stack([u, v]))
    return Case("waves on a square", plain, detail, 0.1, "tangent", expected)


def balls() -> Case:
    """A finer ball around one of 64 x 32 squares; normals in the space of the ball."""

    def place(u: np.ndarray, v: np.ndarray, radius: float) -> np.ndarray:
        lon, lat = 2 * np.pi * u, np.pi * v
        return radius * np.stack([np.sin(lat) * np.sin(lon), np.cos(lat), np.sin(lat) * np.cos(lon)], axis=-1)

    def ball(columns: int, rows: int, radius: float) -> Arrays:
        u, v, triangles = grid(columns, rows)
        return Arrays(place(u, v, radius), triangles, np.column_stack([u, v]))

    plain = ball(64, 32, 0.45)
    # The ray of a texel leaves its facet along the interpolated normal and meets the larger ball there.
    u, v = texels()
    column, row = np.floor(u * 64).astype(int), np.floor(v * 32).astype(int)
    s, t = u * 64 - column, v * 32 - row
    at = row * 65 + column
    lower = t > s
    corners = np.where(
        lower[..., None], np.stack([at, at + 65, at + 66], -1), np.stack([at, at + 66, at + 1], -1)
    )
    weights = np.where(lower[..., None], np.stack([1 - t, t - s, s], -1), np.stack([1 - s, t, s - t], -1))
    points = (plain.positions[corners] * weights[..., None]).sum(-2)
    # Vertex normals of a ball are radial but for the unevenness of its triangles; rays hardly lean.
    expected = unit(points)
    expected[(abs(v - 0.5) > 0.4) | (abs(u - 0.5) > 0.48)] = np.nan
    return Case("ball on a ball", plain, ball(724, 362, 0.5), 0.1, "object", expected)


@contextmanager
def silent() -> Iterator[None]:
    """Keeps Blender's remarks on stdout to itself."""
    sys.stdout.flush()
    kept = os.dup(1)
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)


class Blender:
    """The scene of a case."""

    def __init__(self, case: Case) -> None:
        self.space = case.space.upper()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        detail, plain = case.detail.blenders("detail"), case.plain.blenders("plain")
        self.image = bpy.data.images.new("normals", SIZE, SIZE, float_buffer=True, alpha=False)
        self.image.colorspace_settings.name = "Non-Color"
        material = bpy.data.materials.new("material")
        material.use_nodes = True
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = self.image
        node.select = True
        material.node_tree.nodes.active = node
        plain.data.materials.append(material)
        scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.render.threads_mode = "FIXED"
        scene.render.threads = THREADS
        scene.cycles.samples = 1
        scene.cycles.device = "CPU"
        settings = scene.render.bake
        settings.use_selected_to_active = True
        settings.cage_extrusion = case.reach
        settings.max_ray_distance = 2 * case.reach
        settings.margin = 16
        bpy.context.view_layer.objects.active = plain
        detail.select_set(True)
        plain.select_set(True)

    def __call__(self) -> None:
        with silent():
            bpy.ops.object.bake(type="NORMAL", normal_space=self.space)

    def normals(self) -> np.ndarray:
        pixels = np.empty(SIZE * SIZE * 4, np.float32)
        self.image.pixels.foreach_get(pixels)
        return pixels.reshape(SIZE, SIZE, 4)[::-1, :, :3].astype(np.float64) * 2 - 1


def measured(work: Callable[[], object]) -> tuple[float, float]:
    wall, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - processor


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Degrees between unit vectors, exact for small ones; those not judged are left out."""
    chord = np.linalg.norm(unit(a) - b, axis=-1)
    found = np.degrees(2 * np.arcsin(np.clip(chord / 2, 0, 1)))
    return found[~np.isnan(found)]


def compare(case: Case, rounds: int) -> bool:
    plain, detail = case.plain.ours(), case.detail.ours()
    maps = []

    def ours() -> None:
        maps[:] = [
            bw.bake(
                plain,
                "normal",
                detail=detail,
                size=SIZE,
                front=case.reach,
                rear=case.reach,
                space=case.space,
            )["normal"]
        ]

    blender = Blender(case)
    best = {"bumpwgpu": [np.inf, np.inf], "Blender": [np.inf, np.inf]}
    for _ in range(rounds):
        for name, work in (("bumpwgpu", ours), ("Blender", blender)):
            best[name] = [min(pair) for pair in zip(best[name], measured(work), strict=True)]
    found = {"bumpwgpu": maps[0].astype(np.float64), "Blender": blender.normals()}
    print(f"\n{case.name}: {len(detail.indices)} triangles, {SIZE} x {SIZE} texels, {THREADS} threads")
    print(f"{'':10} {'wall s':>8} {'cpu s':>8} {'median':>9} {'p99':>9} {'max':>9}  (degrees)")
    p99 = {}
    for name, normals in found.items():
        error = angles(normals, case.expected)
        p99[name] = np.percentile(error, 99)
        wall, processor = best[name]
        numbers = f"{np.median(error):9.5f} {p99[name]:9.5f} {error.max():9.5f}"
        print(f"{name:10} {wall:8.3f} {processor:8.3f} {numbers}")
    wall, processor = (b / a for a, b in zip(best["bumpwgpu"], best["Blender"], strict=True))
    print(f"bumpwgpu is {wall:.1f} times as fast ({processor:.1f} by processor time)")
    accurate = p99["bumpwgpu"] <= p99["Blender"]
    print(f"its 99th percentile of the error is {'not ' if accurate else ''}larger than Blender's")
    return bool(accurate)


def main() -> int:
    """Runs both cases; 1 when ours is the less accurate."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=5, help="how often each side runs")
    rounds = parser.parse_args().rounds
    return 0 if all([compare(make(), rounds) for make in (waves, balls)]) else 1


if __name__ == "__main__":
    sys.exit(main())
