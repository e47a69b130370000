"""A relief quad against the same quad truly displaced: one march, one pile of triangles, one picture.

The displaced mesh has a vertex on every texel centre, so its triangles follow the bilinear surface to
within the twist of a cell. It is drawn with the plain ``flat`` technique, which knows nothing of heights.
"""

from __future__ import annotations

import numpy as np
import pytest

import bumpwgpu as bw

pytestmark = pytest.mark.gpu

SIZE = 96
SCALE = 0.15


def displaced_quad(hm: bw.HeightMap, base: float) -> bw.Mesh:
    """The unit quad with a vertex on each texel centre, one ring of texels more on each side."""
    h, w = hm.shape
    i, j = np.arange(-1, w + 1), np.arange(-1, h + 1)
    u, v = np.meshgrid((i + 0.5) / w, (j + 0.5) / h)
    z = SCALE * (hm.array[np.ix_(j % h, i % w)] - base)
    positions = np.stack([u - 0.5, 0.5 - v, z], axis=-1).reshape(-1, 3).astype(np.float32)
    uvs = np.stack([u, v], axis=-1).reshape(-1, 2).astype(np.float32)
    stride = w + 2
    a = (np.arange(h + 1)[:, None] * stride + np.arange(w + 1)[None, :]).ravel()
    corners = [a, a + stride, a + 1, a + 1, a + stride, a + stride + 1]
    indices = np.stack(corners, axis=-1).reshape(-1, 3).astype(np.uint32)
    return bw.Mesh(positions, indices, uvs)


def frames(base: float, eye: tuple[float, float, float], wrong: float = 0.0) -> tuple[bw.Frame, bw.Frame]:
    smooth = bw.HeightMap.procedural("sines", SIZE).array
    hm = bw.HeightMap(smooth, scale=SCALE + wrong, base=base)
    camera = bw.Camera.look_at(eye, (0, 0, 0), up=(0, 1, 0), fov_y=40.0)
    lights = [bw.Light.directional((-1.0, -0.5, -1.0))]
    common = {
        "camera": camera,
        "lights": lights,
        "size": (240, 200),
        "aovs": ("uv", "depth", "position", "mask"),
    }
    relief = bw.render(bw.Mesh.quad(), bw.Material(height=hm), technique="exact", shadows=False, **common)
    truth = bw.render(displaced_quad(hm, base), bw.Material(), technique="flat", **common)
    return relief, truth


def inner(relief: bw.Frame, truth: bw.Frame) -> np.ndarray:
    """Pixels covered by both and clear of silhouettes: the depth around them changes smoothly."""
    both = (relief.aovs["mask"] > 0) & (truth.aovs["mask"] > 0)
    inside = (np.abs(truth.aovs["uv"] - 0.5) < 0.5 - 2 / SIZE).all(-1)
    clear = both & inside
    for frame in (relief, truth):
        depth = np.where(both, frame.aovs["depth"], np.nan)
        for axis in (0, 1):
            for shift in (-1, 1):
                clear &= np.abs(np.roll(depth, shift, axis) - depth) < 0.05
    return clear


@pytest.mark.parametrize("base", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("eye", [(0, 0, 1.6), (0.9, -0.6, 0.9), (-1.2, 0.4, 0.5), (0.2, 1.4, 0.35)])
def test_relief_and_displacement_show_the_same_surface(base: float, eye: tuple[float, float, float]) -> None:
    relief, truth = frames(base, eye)
    clear = inner(relief, truth)
    assert clear.sum() > 3000
    texels = np.linalg.norm(relief.aovs["uv"][clear] - truth.aovs["uv"][clear], axis=-1) * SIZE
    depth = np.abs(relief.aovs["depth"][clear] - truth.aovs["depth"][clear])
    place = np.linalg.norm(relief.aovs["position"][clear] - truth.aovs["position"][clear], axis=-1)
    assert np.percentile(texels, 99) < 0.2
    assert np.percentile(depth, 99) < 0.2 / SIZE
    assert np.percentile(place, 99) < 0.2 / SIZE


def test_a_slightly_deeper_relief_is_noticed() -> None:
    """Negative control: 10 % more height must break the agreement above."""
    eye = (0.9, -0.6, 0.9)
    relief, truth = frames(0.0, eye)
    deeper, _ = frames(0.0, eye, wrong=0.1 * SCALE)
    clear = inner(relief, truth) & (deeper.aovs["mask"] > 0)
    texels = np.linalg.norm(deeper.aovs["uv"][clear] - truth.aovs["uv"][clear], axis=-1) * SIZE
    assert np.percentile(texels, 99) > 0.4
