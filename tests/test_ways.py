"""Two ways to true outlines that were not chosen, in double precision, against displacement."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw

pytestmark = [pytest.mark.gpu, pytest.mark.slow]

Floats = NDArray[np.float64]

SIZE = (132, 108)
FINER = 3
CAMERA = bw.Camera.look_at((0.35, 0.6, 1.5), (0, 0, 0))
PIXEL = 2 * np.tan(np.radians(22.5)) / SIZE[1]
SCALE = 0.08


class Seen(NamedTuple):
    """Depth along the view axis at each pixel, inf where there is nothing."""

    depth: Floats

    @property
    def covered(self) -> NDArray[np.bool_]:
        return np.isfinite(self.depth)


def relief(base: float) -> bw.HeightMap:
    return bw.HeightMap.procedural("sines", 96, scale=SCALE, base=base)


def drawn(mesh: bw.Mesh, heights: bw.HeightMap, finer: int, **options: object) -> bw.Frame:
    return bw.render(
        mesh,
        bw.Material(height=heights),
        camera=CAMERA,
        size=(SIZE[0] * finer, SIZE[1] * finer),
        aovs=("mask", "depth", "position", "uv"),
        shadows=False,
        skip=False,
        **options,  # type: ignore[arg-type]
    )


def seen(frame: bw.Frame) -> Seen:
    return Seen(np.where(frame.aovs["mask"] > 0, frame.aovs["depth"], np.inf).astype(np.float64))


def looked_up(heights: bw.HeightMap, u: Floats, v: Floats) -> Floats:
    """Bilinear, repeated."""
    texels = heights.array.astype(np.float64)
    h, w = texels.shape
    x, y = u * w - 0.5, v * h - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    x, y = x - i, y - j
    at = [texels[(j + b) % h, (i + a) % w] for b in (0, 1) for a in (0, 1)]
    return np.asarray((1 - y) * ((1 - x) * at[0] + x * at[1]) + y * ((1 - x) * at[2] + x * at[3]))


def ways() -> tuple[Floats, Floats]:
    """The eye, and the way through each pixel, 1 along the view axis."""
    eye = np.array(CAMERA.eye)
    ahead = np.subtract(CAMERA.target, eye)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, CAMERA.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    x = (np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) * PIXEL
    y = (SIZE[1] / 2 - np.arange(SIZE[1]) - 0.5) * PIXEL
    return eye, ahead + x[None, :, None] * right + y[:, None, None] * up


def curved_relief(radius: float, heights: bw.HeightMap, on_mesh: bw.Frame) -> Seen:
    """Oliveira and Policarpo, "An Efficient Representation for Surface Details", UFRGS RP-351, 2005.

    The ray is straight in the frame of the pixel, and the mesh bends away from it as a quadric, here with the
    exact curvature.
    """
    _, way = ways()
    covered = on_mesh.aovs["mask"] > 0
    way = way[covered]
    place, uv = (on_mesh.aovs[name][covered].astype(np.float64) for name in ("position", "uv"))
    normal = place / np.linalg.norm(place, axis=1, keepdims=True)
    # Of the sphere of Mesh.sphere: where the texture's axes point, and how long a tile is there.
    east = np.cross((0.0, 1.0, 0.0), normal)
    ring = np.linalg.norm(east, axis=1)
    east /= ring[:, None]
    south = -np.cross(normal, east)
    x, y, z = (np.einsum("ij,ij->i", way, axis) for axis in (east, south, normal))
    tile_u, tile_v = 2 * np.pi * radius * ring, np.pi * radius

    def above(t: Floats, ray: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """How far above the relief rays are, and above the bent mesh."""
        over = z[ray] * t + ((x[ray] * t) ** 2 + (y[ray] * t) ** 2) / (2 * radius)
        level = looked_up(heights, uv[ray, 0] + x[ray] * t / tile_u[ray], uv[ray, 1] + y[ray] * t / tile_v)
        return over - SCALE * (level - 1), over

    far, found, steps = 2.2 * radius, np.full(len(way), np.inf), 800
    open_rays = np.arange(len(way))
    for k in range(1, steps + 1):
        gap, over = above(np.full(len(open_rays), far * k / steps), open_rays)
        new = open_rays[gap <= 0]
        low, high = np.full(len(new), far * (k - 1) / steps), np.full(len(new), far * k / steps)
        for _ in range(30):
            middle = (low + high) / 2
            inside = above(middle, new)[0] <= 0
            low, high = np.where(inside, low, middle), np.where(inside, middle, high)
        found[new] = high
        open_rays = open_rays[(gap > 0) & (over <= 1e-9)]
    depth = np.full(covered.shape, np.inf)
    depth[covered] = on_mesh.aovs["depth"][covered] + found
    return Seen(depth)


def straight_prisms(mesh: bw.Mesh, heights: bw.HeightMap) -> Seen:
    """Hirche et al., "Hardware Accelerated Per-Pixel Displacement Mapping", Graphics Interface 2004.

    The prism over each triangle is three tetrahedra, and rays are straight in each.
    """
    eye, way = ways()
    way = way.reshape(-1, 3)
    positions, normals, uvs = (a.astype(np.float64) for a in (mesh.positions, mesh.normals, mesh.uvs))
    triangles = np.sort(mesh.indices.astype(np.int64), axis=1)

    def lid(level: float) -> list[Floats]:
        """Place, u, v and height of the three corners, on the bottom or the top of all prisms."""
        places = positions + SCALE * (level - heights.base) * normals
        rows = np.column_stack([places, uvs, np.full(len(places), level)])
        return [rows[triangles[:, corner]] for corner in range(3)]

    (a, b, c), (a_top, b_top, c_top) = lid(0.0), lid(1.0)
    parts = ((a, b, c, c_top), (a, b, b_top, c_top), (a, a_top, b_top, c_top))
    tets = np.concatenate([np.stack(part, 1) for part in parts])
    edges = tets[:, 1:, :3] - tets[:, :1, :3]
    solid = np.abs(np.linalg.det(edges)) > 1e-14
    tets, inverse = tets[solid], np.linalg.inv(edges[solid])
    maps = tets[:, 1:, 3:] - tets[:, :1, 3:]
    best = np.full(len(way), np.inf)
    # Weights of the four corners change evenly along a ray.
    for tet, back, slope in zip(tets, inverse, maps, strict=True):
        start = (eye - tet[0, :3]) @ back
        rate = way @ back
        begin = np.append(1 - start.sum(), start)
        change = np.column_stack([-rate.sum(1), rate])
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -begin / change
        enter = np.where(change > 0, t, -np.inf).max(1)
        leave = np.where(change < 0, t, np.inf).min(1)
        rays = np.flatnonzero((enter < leave) & (enter < best) & (leave > 0))
        if not len(rays):
            continue
        t = np.linspace(np.maximum(enter[rays], 0), leave[rays], 33)
        # Texture coordinates and height along each ray.
        first_map, map_rate = tet[0, 3:] + begin[1:] @ slope, change[rays, 1:] @ slope

        def gap(t: Floats, first_map: Floats = first_map, map_rate: Floats = map_rate) -> Floats:
            u, v, level = np.moveaxis(first_map + t[..., None] * map_rate, -1, 0)
            return np.asarray(level - looked_up(heights, u, v))

        below = gap(t) <= 0
        first = below.argmax(0)
        hit = below.any(0)
        low = t[np.maximum(first - 1, 0), np.arange(len(rays))]
        high = t[first, np.arange(len(rays))]
        for _ in range(30):
            middle = (low + high) / 2
            inside = gap(middle) <= 0
            low, high = np.where(inside, low, middle), np.where(inside, middle, high)
        best[rays] = np.where(hit, np.minimum(best[rays], high), best[rays])
    return Seen(best.reshape(SIZE[::-1]))


def judged(truth: Seen, shown: Seen) -> tuple[int, float]:
    """Pixels covered in only one whose neighbours in the other are all alike; place apart, p99, in pixels."""
    h, w = SIZE[1], SIZE[0]
    blocks = truth.depth.reshape(h, FINER, w, FINER)

    def around(values: Floats, pick: np.ufunc) -> Floats:
        padded = np.pad(values, 1, mode="edge")
        return np.asarray(pick.reduce([padded[y : y + h, x : x + w] for y in range(3) for x in range(3)]))

    near, far = around(blocks.min((1, 3)), np.minimum), around(blocks.max((1, 3)), np.maximum)
    off = (shown.covered & ~np.isfinite(near)) | (~shown.covered & np.isfinite(far))
    middle = truth.depth[FINER // 2 :: FINER, FINER // 2 :: FINER]
    with np.errstate(invalid="ignore"):
        calm = shown.covered & np.isfinite(far) & (far - near < 6 * PIXEL * near)
    _, way = ways()
    length = np.linalg.norm(way[calm], axis=1)
    apart = np.abs(shown.depth[calm] - middle[calm]) * length / (PIXEL * middle[calm])
    return int(off.sum()), float(np.percentile(apart, 99))


@pytest.mark.parametrize("base", [0.0, 1.0])
def test_what_other_ways_are_off_on_a_sphere(base: float) -> None:
    radius = 0.5
    mesh, heights = bw.Mesh.sphere(radius, 48), relief(base)
    truth = seen(drawn(mesh, heights, FINER, technique="displacement"))
    found = {
        "shell": judged(truth, seen(drawn(mesh, heights, 1, technique="exact", silhouettes=True))),
        "prisms of tetrahedra": judged(truth, straight_prisms(mesh, heights)),
        "straight rays": judged(truth, seen(drawn(mesh, heights, 1, technique="exact"))),
    }
    if base == 1.0:  # it has no rays but those that meet the mesh
        bare = drawn(mesh, heights, 1, technique="flat")
        found["curved relief"] = judged(truth, curved_relief(radius, heights, bare))
    for way, (off, place) in found.items():
        print(f"base {base}, {way}: outline off {off}, place p99 {place:.3f} pixels")
    shell = found.pop("shell")
    assert shell[0] == 0
    assert shell[1] < 0.1
    assert all(off > 0 or place > 3 * shell[1] for off, place in found.values())
