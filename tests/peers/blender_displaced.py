"""Outlines, depths and shadows of displaced meshes, against Blender: Cycles' true displacement.

Blender is given the same mesh, its triangles cut into micro-triangles of less than half a pixel and less than
half a texel (by halving edges: Blender's own "simple" subdivision bends what it should leave flat); the
material displaces these, with its own lookup of the image, by (h - base) scale along the mesh's normals, and
Cycles follows a ray through the middle of each pixel, and eight around it. "own normals" leaves direction and
cutting to Blender too: an ordinary displacement node and Cycles' adaptive subdivision, on meshes so fine that
the smooth normals of both agree. The materials glow with their position, so what is compared is where each
pixel's ray ends, not what colour it has; shadows come from a second picture, lit by a sun. A camera of less
than a degree, far away, stands for parallel rays.

Covered: pixels with anything in them. Outline: pixels covered in only one of the two, and how far the worst
is from the other's outline. Astray: pixels covered in both whose depth is not within a pixel of Blender's in
the pixels around, all nine rays of each, and those only Blender covers, all around. Place: distance between
the two points, in pixels, where depth does not jump. Shadow: share of the pixels that are lit in only one, a
pixel away from the edge of any shadow.

Blender leaves the gaps open that seams and hard edges tear; strips close them here.

Models: `python tests/peers/run.py blender_displaced -- --models folder/*.obj`
"""

# requires: bpy==5.0.1 numpy pillow

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

import bumpwgpu as bw

warnings.simplefilter("ignore")

SIZE = (200, 160)
# Blender draws each pixel as a square of so many (odd: one is in the middle): some things are thinner.
FINER = 3
# Positions are kept positive, which a glow must be.
LIFT = 16.0
SUN = (0.45, 0.8, 0.6)
BLACK, SOFT = (0.0, 0.0, 0.0, 1.0), 0.01


class Case(NamedTuple):
    """What is drawn: a mesh, its relief, where it stands, from where, and how often edges are halved."""

    name: str
    mesh: bw.Mesh
    heights: bw.HeightMap
    camera: bw.Camera
    halved: int
    place: np.ndarray = np.eye(4)
    own_normals: bool = False


class Picture(NamedTuple):
    """Where rays end, (H, W, 3), NaN where there is nothing; and where the sun reaches what is seen."""

    places: np.ndarray
    lit: np.ndarray

    @property
    def covered(self) -> np.ndarray:
        return np.isfinite(self.places[..., 0])


@contextmanager
def silent() -> Iterator[None]:
    """Keeps Blender's remarks on stdout to itself."""
    sys.stdout.flush()
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)


def view(camera: bw.Camera) -> np.ndarray:
    """World from camera: right, up, back and the eye in columns."""
    eye = np.array(camera.eye)
    back = eye - camera.target
    back /= np.linalg.norm(back)
    right = np.cross(camera.up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, np.cross(back, right), back, eye])
    return matrix


def halved(triangles: np.ndarray, corners: np.ndarray, times: int) -> tuple[np.ndarray, np.ndarray]:
    """Each triangle cut into four, so many times; `corners` holds what is interpolated, a row each."""
    for _ in range(times):
        sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1)
        edges, which = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
        middle = len(corners) + which.reshape(-1, 3)
        corners = np.concatenate([corners, corners[edges].mean(axis=1)])
        (a, b, c), (ab, bc, ca) = triangles.T, middle.T
        triangles = np.concatenate(
            [np.stack(part, 1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return triangles, corners


def blenders_mesh(case: Case) -> bpy.types.Object:
    """The mesh with its UVs; with the normals as the attribute "way", or welded for normals of Blender's."""
    mesh = case.mesh
    if case.own_normals:
        _, first, back = np.unique(mesh.positions.round(6), axis=0, return_index=True, return_inverse=True)
        indices = back.ravel()[mesh.indices]
        whole = (indices != np.roll(indices, 1, axis=1)).all(axis=1)
        indices, positions = indices[whole], mesh.positions[first]
        uvs = mesh.uvs[mesh.indices[whole]].reshape(-1, 2)
    else:
        corners = np.hstack([mesh.positions, mesh.normals, mesh.uvs]).astype(np.float64)
        indices, corners = halved(mesh.indices.astype(np.int64), corners, case.halved)
        positions, ways, uvs = corners[:, :3], corners[:, 3:6], corners[indices.ravel(), 6:]
    made = bpy.data.meshes.new("mesh")
    made.vertices.add(len(positions))
    made.vertices.foreach_set("co", positions.astype(np.float32).ravel())
    made.loops.add(indices.size)
    made.loops.foreach_set("vertex_index", indices.astype(np.int32).ravel())
    made.polygons.add(len(indices))
    made.polygons.foreach_set("loop_start", np.arange(0, indices.size, 3, dtype=np.int32))
    made.update(calc_edges=True)
    made.polygons.foreach_set("use_smooth", np.full(len(indices), case.own_normals))
    layer = made.uv_layers.new(name="UV")
    layer.data.foreach_set("uv", (uvs * (1, -1) + (0, 1)).astype(np.float32).ravel())
    if not case.own_normals:
        way = made.attributes.new("way", "FLOAT_VECTOR", "POINT")
        way.data.foreach_set("vector", ways.astype(np.float32).ravel())
    made.update()
    thing = bpy.data.objects.new("thing", made)
    bpy.context.collection.objects.link(thing)
    thing.matrix_world = case.place.T.tolist()
    if case.own_normals:
        cut = thing.modifiers.new("cut", "SUBSURF")
        cut.subdivision_type, cut.uv_smooth = "SIMPLE", "NONE"
        cut.use_adaptive_subdivision, cut.adaptive_pixel_size = True, 1.2
    return thing


def displace(material: bpy.types.Material, case: Case) -> None:
    """Nodes that move the surface."""
    tree, heights = material.node_tree, case.heights
    add, link = tree.nodes.new, tree.links.new
    rows, columns = heights.shape
    image = bpy.data.images.new("heights", columns, rows, float_buffer=True, is_data=True)
    values = np.ones((rows, columns, 4), np.float32)
    values[..., :3] = heights.array[::-1, :, None]
    image.pixels.foreach_set(values.ravel())
    image.update()
    lookup = add("ShaderNodeTexImage")
    lookup.image, lookup.interpolation = image, "Linear"
    lookup.extension = {"repeat": "REPEAT", "clamp": "EXTEND", "mirror": "MIRROR"}[heights.wrap]
    if case.own_normals:
        move = add("ShaderNodeDisplacement")
        move.inputs["Midlevel"].default_value = heights.base
        move.inputs["Scale"].default_value = heights.scale
        link(lookup.outputs["Color"], move.inputs["Height"])
    else:
        way, unit, along, amount = (
            add(f"ShaderNode{kind}") for kind in ("Attribute", "VectorMath", "VectorMath", "Math")
        )
        way.attribute_name = "way"
        unit.operation, along.operation, amount.operation = "NORMALIZE", "SCALE", "MULTIPLY_ADD"
        amount.inputs[1].default_value = heights.scale
        amount.inputs[2].default_value = -heights.base * heights.scale
        link(lookup.outputs["Color"], amount.inputs[0])
        link(way.outputs["Vector"], unit.inputs[0])
        link(unit.outputs[0], along.inputs[0])
        link(amount.outputs[0], along.inputs["Scale"])
        move = add("ShaderNodeVectorDisplacement")
        move.space = "OBJECT"
        move.inputs["Midlevel"].default_value, move.inputs["Scale"].default_value = 0.0, 1.0
        link(along.outputs[0], move.inputs["Vector"])
    link(move.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Displacement"])
    material.displacement_method = "DISPLACEMENT"


def drawn(folder: Path) -> np.ndarray:
    """The picture of the scene as it is, (FINER H, FINER W, 4) with row 0 on top, as Cycles counts light."""
    scene, path = bpy.context.scene, folder / "picture.exr"
    scene.render.filepath = str(path)
    with silent():
        bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1].astype(np.float64)


def blenders(case: Case, folder: Path) -> Picture:
    """Cycles' picture of the case."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = (FINER * side for side in SIZE)
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    settings.exr_codec = "ZIP"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = "CPU", 1, False, False
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", SOFT
    cycles.dicing_rate, cycles.max_subdivisions, cycles.max_bounces = 1.0, 12, 0
    scene.render.threads_mode = "FIXED"
    scene.render.threads = len(os.sched_getaffinity(0))
    seen_from = bpy.data.cameras.new("camera")
    seen_from.sensor_fit, seen_from.angle_y = "VERTICAL", np.radians(case.camera.fov_y)
    seen_from.angle = np.radians(case.camera.fov_y)
    far = float(np.linalg.norm(np.subtract(case.camera.eye, case.camera.target)))
    seen_from.clip_start, seen_from.clip_end = far * 1e-3, far * 1e3
    camera = bpy.data.objects.new("camera", seen_from)
    bpy.context.collection.objects.link(camera)
    camera.matrix_world = view(case.camera).T.tolist()
    scene.camera = camera
    thing = blenders_mesh(case)
    thing.cycles.shadow_terminator_geometry_offset = thing.cycles.shadow_terminator_offset = 0.0
    material = bpy.data.materials.new("material")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    add, link = tree.nodes.new, tree.links.new
    result, glow, geometry, lift = (
        add(f"ShaderNode{kind}") for kind in ("OutputMaterial", "Emission", "NewGeometry", "VectorMath")
    )
    lift.inputs[1].default_value = (LIFT,) * 3
    link(geometry.outputs["Position"], lift.inputs[0])
    link(lift.outputs[0], glow.inputs["Color"])
    link(glow.outputs[0], result.inputs["Surface"])
    displace(material, case)
    thing.data.materials.append(material)
    glowing = drawn(folder)
    places = glowing[..., :3] - LIFT
    places[glowing[..., 3] < 0.5] = np.nan
    matte = add("ShaderNodeBsdfDiffuse")
    matte.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    link(matte.outputs[0], result.inputs["Surface"])
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.angle, sun.data.energy = 0.0, 3.0
    bpy.context.collection.objects.link(sun)
    sun.matrix_world = view(bw.Camera.look_at(SUN, (0, 0, 0))).T.tolist()
    return Picture(places, drawn(folder)[..., 0] > 0)


def ours(case: Case, **options: object) -> Picture:
    """Our picture of the case."""
    frame = bw.render(
        [bw.Instance(case.mesh, bw.Material(height=case.heights, double_sided=True), case.place)],
        camera=case.camera,
        lights=[bw.Light.directional([-way for way in SUN])],
        size=SIZE,
        aovs=("position", "mask", "shadow", "normal"),
        **options,
    )
    places = frame.aovs["position"].astype(np.float64)
    places[frame.aovs["mask"] == 0] = np.nan
    facing = frame.aovs["normal"].astype(np.float64) @ (SUN / np.linalg.norm(SUN)) > 0
    return Picture(places, (frame.aovs["shadow"] < 0.5) & facing)


def around(values: np.ndarray, pick: np.ufunc, reach: int = 1) -> np.ndarray:
    """The least or greatest of the values within so many pixels of each."""
    padded, (h, w) = np.pad(values, reach, mode="edge"), values.shape
    steps = range(2 * reach + 1)
    return np.asarray(pick.reduce([padded[y : y + h, x : x + w] for y in steps for x in steps]))


def within(values: np.ndarray, pick: np.ufunc) -> np.ndarray:
    """The least or greatest of the values of a finer picture in each pixel and those next to it."""
    w, h = SIZE
    return around(pick.reduce(values.reshape(h, FINER, w, FINER), axis=(1, 3)), pick)


def outline_apart(a: np.ndarray, b: np.ndarray) -> int:
    """How many pixels away, at most, what only one covers is from where both agree on it."""
    apart = 0
    for one, other in ((a, b), (b, a)):
        left, grown = one & ~other, other
        distance = 0
        while left.any() and distance < 50:
            grown, distance = around(grown, np.logical_or), distance + 1
            left = left & ~grown
        apart = max(apart, distance)
    return apart


class Judgement(NamedTuple):
    """How far two pictures are apart."""

    covered: int
    outline: int
    apart: int
    astray: int
    place: np.ndarray
    shadow: float

    def __str__(self) -> str:
        p50, p99, most = np.percentile(self.place, (50, 99, 100))
        return (
            f"{self.covered:7} {self.outline:7} {self.apart:5} {self.astray:6}  "
            f"{p50:7.4f} {p99:7.4f} {most:7.3f} {100 * self.shadow:8.2f}"
        )


def judged(camera: bw.Camera, finer: Picture, shown: Picture) -> Judgement:
    """A picture against one that is `FINER` times as large."""
    matrix = view(camera)

    def depth(picture: Picture) -> np.ndarray:
        return -((picture.places - matrix[:3, 3]) @ matrix[:3, 2])

    middle = slice(FINER // 2, None, FINER)
    truth = Picture(finer.places[middle, middle], finer.lit[middle, middle])
    real, seen, a, b = depth(finer), depth(shown), truth.covered, shown.covered
    pixel = 2 * np.tan(np.radians(camera.fov_y) / 2) / SIZE[1] * np.nan_to_num(seen, nan=1.0)
    near = within(np.where(finer.covered, real, np.inf), np.minimum)
    far = within(np.where(finer.covered, real, -np.inf), np.maximum)
    whole = within(finer.covered, np.logical_and)
    with np.errstate(invalid="ignore"):
        beyond = a & b & ~((seen > near - pixel) & (seen < far + pixel))
        calm = a & b & whole & (far - near < 6 * pixel)
    place = np.linalg.norm(truth.places - shown.places, axis=-1)[calm] / pixel[calm]
    still = calm & (within(finer.lit, np.logical_and) | ~within(finer.lit, np.logical_or))
    return Judgement(
        int(a.sum()),
        int((a != b).sum()),
        outline_apart(a, b),
        int((beyond | (~b & whole)).sum()),
        place,
        float((truth.lit != shown.lit)[still].mean()) if still.any() else 0.0,
    )


def framed(heights: np.ndarray) -> np.ndarray:
    """Heights that are zero at the border."""
    v, u = (np.minimum(1, 8 * np.minimum(t, 1 - t)) for t in (np.linspace(0, 1, n) for n in heights.shape))
    return heights * v[:, None] * u


def cases() -> Iterator[Case]:
    heights = bw.HeightMap.procedural("sines", 96).array
    raised, carved = (bw.HeightMap(heights, scale=0.1, base=base) for base in (0.0, 1.0))
    near = bw.Camera.look_at((0.7, 0.6, 1.5), (0, 0, 0), fov_y=45)
    away = np.array([60.0, 45.0, 110.0])
    parallel = bw.Camera.look_at(away, (0, 0, 0), fov_y=0.7)
    border = bw.HeightMap(framed(heights), scale=0.1, base=0.0, wrap="clamp")
    shapes = {
        "quad": (bw.Mesh.quad(1.0), 9),
        "sphere": (bw.Mesh.sphere(0.5, 48), 4),
        "torus": (bw.Mesh.torus(0.45, 0.2, 48, 24), 4),
    }
    yield Case("cube, bumps that end before its edges", bw.Mesh.cube(0.7), border, near, 8)
    for name, (mesh, halved) in shapes.items():
        for kind, relief in (("raised", raised), ("carved", carved)):
            yield Case(f"{name}, {kind}", mesh, relief, near, halved)
        yield Case(f"{name}, parallel rays", mesh, raised, parallel, halved)
    stretched = np.diag([-1.2, 0.6, 0.9, 1.0])
    stretched[:3, 3] = 0.05, -0.1, 0.1
    yield Case("torus, stretched and mirrored", shapes["torus"][0], raised, near, 4, stretched)
    skimming = bw.Camera.look_at((1.3, 0.1, 0.58), (0, 0, 0.45), up=(0, 0, 1), fov_y=40)
    yield Case("sphere, along the surface", shapes["sphere"][0], raised, skimming, 5)
    yield Case("ball, own normals", bw.Mesh.sphere(0.5, segments=192), raised, near, 0, own_normals=True)
    yield Case("ring, own normals", bw.Mesh.torus(0.45, 0.2, 192, 96), raised, near, 0, own_normals=True)


def of_model(path: Path) -> Case:
    mesh = bw.Mesh.open(path)
    low, high = mesh.positions.min(0), mesh.positions.max(0)
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    place = np.diag([2 / size] * 3 + [1.0])
    place[:3, 3] = -middle * 2 / size
    heights = bw.HeightMap(bw.HeightMap.procedural("sines", 64).array, scale=0.02 * size, base=0.0)
    eye = 2.2 * np.array((0.5, 0.4, 0.9)) / np.linalg.norm((0.5, 0.4, 0.9))
    halved = int(np.clip(np.ceil(np.log(5e5 / 3 / len(mesh.indices)) / np.log(4)) + 1, 2, 8))
    return Case(path.stem, mesh, heights, bw.Camera.look_at(eye, (0, 0, 0)), halved, place)


def main() -> int:
    """Compares every case; 1 when traced relief has anything astray on those that are whole."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--models", type=Path, nargs="*", default=[], help="OBJ or glTF files to add")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--pictures", type=Path, help="folder to save the points of all three in, as npz")
    given = parser.parse_args()
    print(f"{'':40} covered outline apart astray  place: p50, p99, max px  shadow %")
    failed = False
    ways = {
        "shell": {"technique": "exact", "silhouettes": True},
        "displacement": {"technique": "displacement"},
        "straight rays": {"technique": "exact"},
    }
    with tempfile.TemporaryDirectory() as folder:
        for case in (*cases(), *map(of_model, given.models)):
            if given.only not in case.name:
                continue
            print(case.name, flush=True)
            truth = blenders(case, Path(folder))
            pictures = {way: ours(case, **options) for way, options in ways.items()}
            for way, shown in pictures.items():
                found = judged(case.camera, truth, shown)
                print(f"    {way:36} {found}", flush=True)
                failed |= way != "straight rays" and found.astray > 0
            if given.pictures:
                kept = {"blender": truth, **pictures}
                flat = {
                    f"{way} {part}".replace(" ", "_"): getattr(picture, part)
                    for way, picture in kept.items()
                    for part in Picture._fields
                }
                given.pictures.mkdir(parents=True, exist_ok=True)
                np.savez(given.pictures / f"{case.name.replace(' ', '_').replace(',', '')}.npz", **flat)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
