"""Relief traced through shells against displaced triangles where it is hard: from inside the shell, cut off
by the near plane, along the surface, and on models that other people made."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import bumpwgpu as bw

pytestmark = pytest.mark.gpu

SIZE = (120, 96)
# Displacement is drawn so much finer, and finer still where that does not settle it: some things are thinner
# than a pixel.
FINER = (4, 12)
# The near plane is at this share of the way to the target.
NEAR_SHARE = 1e-5


def drawn(mesh: bw.Mesh, heights: bw.HeightMap, camera: bw.Camera, finer: int) -> bw.Frame:
    """Traced through the shell, or for `finer` above 0 displaced, of so many times the size."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bw.BumpWarning)
        return bw.render(
            mesh,
            bw.Material(height=heights),
            camera=camera,
            technique="displacement" if finer else "exact",
            silhouettes=not finer,
            size=(SIZE[0] * max(finer, 1), SIZE[1] * max(finer, 1)),
            aovs=("mask", "depth"),
            shadows=False,
        )


def around(values: np.ndarray, pick: np.ufunc) -> np.ndarray:
    """The least or greatest of the values within a pixel of each, of a picture some times as large."""
    w, h = SIZE
    finer = len(values) // h
    cells = pick.reduce(values.reshape(h, finer, w, finer), axis=(1, 3))
    padded = np.pad(cells, 1, mode="edge")
    return np.asarray(pick.reduce([padded[y : y + h, x : x + w] for y in range(3) for x in range(3)]))


def astray(truth: bw.Frame, shown: bw.Frame) -> np.ndarray:
    """Where outline or depth is not within a pixel of the truth, which is finer."""
    there, here = truth.aovs["mask"] == 1, shown.aovs["mask"] == 1
    near = around(np.where(there, truth.aovs["depth"], np.inf), np.minimum)
    far = around(np.where(there, truth.aovs["depth"], -np.inf), np.maximum)
    seen = shown.aovs["depth"]
    slack = 2 * np.tan(np.radians(22.5)) / SIZE[1] * np.where(here, seen, 0)
    wrong = here & ~((seen > near - slack) & (seen < far + slack))
    missing = ~here & around(there.astype(int), np.minimum).astype(bool)
    return np.asarray(wrong | missing)


def judged(mesh: bw.Mesh, heights: bw.HeightMap, camera: bw.Camera) -> tuple[int, int]:
    """Pixels that are covered, and those that are astray however finely the truth is drawn."""
    shown = drawn(mesh, heights, camera, 0)
    wrong = np.ones(SIZE[::-1], bool)
    for finer in FINER:
        if wrong.any():
            wrong &= astray(drawn(mesh, heights, camera, finer), shown)
    return int((shown.aovs["mask"] == 1).sum()), int(wrong.sum())


def nothing_astray(name: str, camera: bw.Camera, least: int) -> None:
    """Fails unless more than `least` pixels are covered and none is astray."""
    pixels, wrong = judged(SHAPES[name][0], BUMPS, camera)
    print(f"{name}: {pixels} pixels, {wrong} astray")
    assert pixels > least
    assert wrong == 0


BUMPS = bw.HeightMap.procedural("sines", 96, scale=0.1, base=0.0)
SHAPES = {
    "quad": (bw.Mesh.quad(1.0), (0.11, 0.07, 1.0)),
    "cube": (bw.Mesh.cube(0.8), (0.11, 0.07, 1.0)),
    "sphere": (bw.Mesh.sphere(0.5), (0.2, 0.35, 1.0)),
    "torus": (bw.Mesh.torus(0.45, 0.2), (0.1, 1.0, 0.44)),
}


def ground(mesh: bw.Mesh, above: tuple[float, float, float]) -> np.ndarray:
    """The point of the displaced surface on the way from a place to the middle."""
    target = np.array([0.1 * above[0], 0.0, 0.44]) if above[1] == 1.0 else np.zeros(3)
    camera = bw.Camera.look_at(above, target, fov_y=1.0)
    frame = bw.render(
        mesh,
        bw.Material(height=BUMPS),
        camera=camera,
        technique="displacement",
        size=(9, 9),
        aovs=("position", "mask"),
        shadows=False,
    )
    assert frame.aovs["mask"].all()
    return np.asarray(frame.aovs["position"][4, 4], dtype=float)


def standing(name: str) -> tuple[bw.Mesh, np.ndarray, np.ndarray]:
    """A mesh, an eye a tenth of the relief above its surface, and what is up there."""
    mesh, above = SHAPES[name]
    foot = ground(mesh, above)
    up = np.array([0.0, 1.0, 0.0]) if name == "torus" else np.array([0.0, 0.0, 1.0])
    if name == "sphere":
        up = foot / np.linalg.norm(foot)
    return mesh, foot + 0.01 * up, up


def test_what_is_moved_by_a_twentieth_of_the_relief_is_noticed() -> None:
    """Negative control of the test below."""
    mesh, eye, up = standing("sphere")
    target = eye + 0.4 * np.cross(up, (1.0, 0.2, -0.05)) - 0.05 * up
    camera, higher = (bw.Camera.look_at(eye + rise * up, target, up=up) for rise in (0.0, 0.005))
    real = drawn(mesh, BUMPS, camera, FINER[0])
    assert astray(real, drawn(mesh, BUMPS, camera, 0)).sum() < 10
    assert astray(real, drawn(mesh, BUMPS, higher, 0)).sum() > 100


@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
def test_the_camera_may_stand_in_the_shell(name: str) -> None:
    _, eye, up = standing(name)
    for along in ((1.0, 0.2, -0.05), (-0.3, -1.0, 0.1)):
        side = np.cross(up, along)
        target = eye + 0.4 * side / np.linalg.norm(side) - 0.05 * up
        nothing_astray(name, bw.Camera.look_at(eye, target, up=up), 1000)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
def test_the_near_plane_cuts_reliefs_open(name: str) -> None:
    eye = np.array([0.5, 0.6, 0.9])
    middle = np.linalg.norm(eye)
    for cut in (0.6, 0.7):
        # So far away a target that the near plane lies in the mesh.
        target = eye - eye / middle * (cut * middle / NEAR_SHARE)
        nothing_astray(name, bw.Camera.look_at(eye, target), 300)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
def test_grazing_views_are_those_of_displacement(name: str) -> None:
    for eye, target in (((1.2, 0.02, 0.52), (0.0, 0.0, 0.47)), ((0.03, 1.4, 0.5), (0.0, 0.0, 0.46))):
        nothing_astray(name, bw.Camera.look_at(eye, target, up=(0, 0, 1)), 300)


# Height of the relief, in shares of the model's size. Where surfaces run through themselves, as on slivers of
# rancid_geometry, micro-polygons are no judge: rays in double precision are (crates/render/tests/models.rs).
MODELS = {
    "obj/mikktspace/doomcone_smooth.obj": 0.02,
    "obj/meshoptimizer/pirate.obj": 0.01,
    "obj/tinyobjloader/map-bump.obj": 0.02,
    "obj/trimesh/fuze.obj": 0.02,
}


@pytest.mark.slow
@pytest.mark.parametrize("path", MODELS)
@pytest.mark.parametrize("base", [0.0, 1.0])
def test_models_of_others_are_those_of_displacement(assets: Path, path: str, base: float) -> None:
    share = MODELS[path]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bw.BumpWarning)
        mesh = bw.Mesh.open(assets / path)
    low, high = mesh.positions.min(0), mesh.positions.max(0)
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    heights = bw.HeightMap.procedural("sines", 64, scale=share * size, base=base)
    for way in ((0.5, 0.4, 0.9), (-0.8, 0.3, -0.5)):
        eye = middle + size * 1.1 * np.array(way) / np.linalg.norm(way)
        pixels, wrong = judged(mesh, heights, bw.Camera.look_at(eye, middle))
        print(f"{path} {base}: {pixels} pixels, {wrong} astray")
        assert pixels > 500
        assert wrong == 0


def slivers(seed: int) -> bw.Mesh:
    """Long thin triangles, normals at their corners far apart: their prisms are folded over themselves."""
    random = np.random.default_rng(seed)

    def unit(vector: np.ndarray) -> np.ndarray:
        return np.asarray(vector / np.linalg.norm(vector))

    places, normals = [], []
    for _ in range(24):
        corner, along = random.uniform(-0.7, 0.7, 3), unit(random.normal(size=3))
        beside = unit(np.cross(along, random.normal(size=3)))
        places += [corner, corner + 0.02 * beside, corner + 0.5 * along]
        normals += [unit(unit(np.cross(beside, along)) + 1.5 * random.normal(size=3)) for _ in range(3)]
    uvs = np.tile([(0.0, 0.0), (0.02, 0.0), (0.0, 0.5)], (24, 1))
    return bw.Mesh(
        np.array(places, np.float32),
        np.arange(72, dtype=np.uint32).reshape(-1, 3),
        uvs.astype(np.float32),
        normals=np.array(normals, np.float32),
    )


@pytest.mark.parametrize("base", [0.0, 1.0])
def test_what_is_seen_of_folded_prisms_is_within_the_relief_of_a_triangle(base: float) -> None:
    mesh, scale = slivers(0), 0.1
    frame = bw.render(
        mesh,
        bw.Material(height=bw.HeightMap(BUMPS.array, scale=scale, base=base), double_sided=True),
        camera=bw.Camera.look_at((0.4, 0.5, 2.6), (0, 0, 0)),
        technique="exact",
        silhouettes=True,
        size=SIZE,
        aovs=("position", "mask"),
        shadows=False,
    )
    seen = frame.aovs["position"][frame.aovs["mask"] == 1].astype(float)
    assert len(seen) > 200
    steps = np.arange(101) / 100
    # Triangles are thin: three lines along each are nearly all of it.
    weights = np.array([(a * (1 - b), a * b, 1 - a) for a in steps for b in (0.0, 0.5, 1.0)])

    def farthest(positions: np.ndarray) -> float:
        points = np.concatenate([weights @ positions[triangle] for triangle in mesh.indices])
        nearest = [np.sqrt(((points - place) ** 2).sum(1).min()) for place in seen]
        return float(np.max(nearest))

    assert farthest(mesh.positions.astype(float)) < 1.15 * scale
    assert farthest(mesh.positions.astype(float) + 0.2) > 1.5 * scale, "negative control"
