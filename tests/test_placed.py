"""Placed objects, clause by clause: every technique under stretching and mirroring transforms, materials of
their own, and everything a million units away."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw

# Some cast no shadows, and say so.
pytestmark = [pytest.mark.gpu, pytest.mark.filterwarnings("ignore::bumpwgpu.BumpWarning")]

WAYS = [*((name, False) for name in bw.techniques.names()), ("exact", True)]
# Those that the quick tests try.
FEW = [("normal", False), ("relief", False), ("exact", False), ("exact", True), ("displacement", False)]
# What these do depends on the angle of view, which they take in the mesh's own space (docs/scenes.md).
BY_ANGLE = ("parallax_limited", "steep_linear", "steep_exponential")
SCALES = [(-1.2, 0.6, 1.6), (0.8, 1.1, -0.7), (1.3, 0.7, 0.5), (-0.9, -1.2, -2.0)]
OUTPUTS = ("uv", "depth", "position", "normal", "shadow", "mask", "height")
TEXELS = 64


def bumps(scale: float, seed: int = 0) -> bw.HeightMap:
    return bw.HeightMap.procedural("fbm", TEXELS, seed, scale=scale, base=0.5)


def draw(what: Any, material: Any = None, **options: Any) -> bw.Frame:
    defaults: dict[str, Any] = {
        "camera": bw.Camera.look_at((0.9, 0.7, 1.9), (0.05, 0, 0), fov_y=40.0),
        "lights": [bw.Light.directional((-0.5, -0.7, -0.6))],
        "size": (72, 60),
        "aovs": OUTPUTS,
        "shadows": True,
    }
    return bw.render(what, material, **{**defaults, **options})


def moved(matrix: Any, shift: Any = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
    place = np.eye(4)
    place[:3, :3] = matrix
    place[:3, 3] = shift
    return place


def stretched(technique: str, silhouettes: bool, scale: tuple[float, float, float]) -> None:
    """On a flat square the object that a transform makes can be written down: corners moved, the relief as
    high as the transform makes it, wound the other way where it mirrors."""
    square, depth = bw.Mesh.quad(), abs(scale[2])
    material = bw.Material(height=bumps(0.1), specular=0.3, shininess=20.0)
    mirrors = np.prod(scale) < 0
    made = bw.Mesh(
        square.positions * np.array(scale, np.float32),
        square.indices[:, ::-1] if mirrors else square.indices,
        square.uvs,
        normals=square.normals * np.float32(np.sign(scale[2])),
    )
    # A turn shows the side that the relief is on.
    back = np.diag([-1.0, 1.0, -1.0]) if scale[2] < 0 else np.eye(3)
    # What may be left out within a bound is not what is judged here.
    options: dict[str, Any] = {"technique": technique, "silhouettes": silhouettes, "skip": False}
    placed = draw(bw.Instance(square, material, moved(back @ np.diag(scale))), **options)
    higher = bw.HeightMap(
        bumps(0.1).array, scale=0.1 * depth, base=0.5, tile_size=(abs(scale[0]), abs(scale[1]))
    )
    truth, other = (
        draw(
            bw.Instance(made, bw.Material(height=heights, specular=0.3, shininess=20.0), moved(back)),
            **options,
        )
        for heights in (higher, bw.HeightMap(1 - bumps(0.1).array, scale=0.1 * depth, base=0.5))
    )
    both = (placed.aovs["mask"] > 0) & (truth.aovs["mask"] > 0)
    assert both.sum() > 400
    assert (placed.aovs["mask"] != truth.aovs["mask"]).sum() <= 2

    def off(frame: bw.Frame) -> dict[str, float]:
        cosines = np.clip((frame.aovs["normal"] * truth.aovs["normal"]).sum(axis=2)[both], -1, 1)
        return {
            "texels": float(np.quantile(np.abs(frame.aovs["uv"] - truth.aovs["uv"])[both], 0.99)) * TEXELS,
            "depth": float(
                np.quantile(np.abs(frame.aovs["depth"][both] / truth.aovs["depth"][both] - 1), 0.99)
            ),
            "normal": float(np.degrees(np.arccos(np.quantile(cosines, 0.01)))),
            "shadow": float((np.abs(frame.aovs["shadow"] - truth.aovs["shadow"]) > 0.5)[both].mean()),
            "color": float(np.quantile(np.abs(frame.color.astype(int) - truth.color)[both], 0.99)),
        }

    found = off(placed)
    print(technique, scale, found)
    texels, depth, normal = 2e-3, 1e-5, 0.15
    if technique == "displacement":  # made of triangles, which are not the same
        texels, depth, normal = 0.1, 2e-3, 1.0
    elif technique in BY_ANGLE:
        texels, depth, normal = 1.0, 2e-2, 10.0
    elif technique == "dot3":  # of a normal map that was baked for the mesh as it was
        normal = 3.0
    assert found["texels"] < texels, found
    assert found["depth"] < depth, found
    assert found["normal"] < normal, found
    assert found["shadow"] < 0.02, found
    assert found["color"] <= 2 or technique in ("dot3", "displacement", *BY_ANGLE), found
    if technique != "flat":
        assert off(other)["normal"] > 2 * normal, "another relief is another picture"


@pytest.mark.parametrize(("technique", "silhouettes"), FEW)
@pytest.mark.parametrize("scale", SCALES[:2])
def test_a_stretched_or_mirrored_square_is_the_one_made_so(
    technique: str, silhouettes: bool, scale: tuple[float, float, float]
) -> None:
    stretched(technique, silhouettes, scale)


@pytest.mark.slow
@pytest.mark.parametrize(("technique", "silhouettes"), WAYS)
@pytest.mark.parametrize("scale", SCALES)
def test_every_technique_follows_every_transform(
    technique: str, silhouettes: bool, scale: tuple[float, float, float]
) -> None:
    stretched(technique, silhouettes, scale)


def sorted_by(frame: bw.Frame, instance: bw.Instance) -> np.ndarray:
    """Depths of an object alone, none beyond where the ray leaves the box around it and its relief."""
    mesh, relief = instance.mesh, instance.material.height.scale
    ends = np.concatenate([mesh.positions + mesh.normals * side * relief for side in (-1, 1)])
    inside = np.linalg.inv(instance.world_from_object)
    eye = inside[:3, :3] @ (0.9, 0.7, 1.9) + inside[:3, 3]
    ray = frame.aovs["position"] @ inside[:3, :3].T + inside[:3, 3] - eye
    leaves = (np.where(ray > 0, ends.max(0), ends.min(0)) - eye) / np.where(ray == 0, 1e-30, ray)
    depth = frame.aovs["depth"] * np.minimum(leaves.min(axis=2), 1.0)
    return np.where(frame.aovs["mask"] > 0, depth, np.inf)


def test_a_scene_is_its_objects_one_before_the_other() -> None:
    """Objects with albedo, heights, normals and highlights of their own, two with the same mesh; where they
    are in front they look as they do alone."""
    grid = np.indices((32, 32)).sum(0) % 8 < 4
    checks = np.stack([grid * 200, grid * 80 + 90, 255 - grid * 255], axis=2).astype(np.uint8)
    leaning = np.zeros((16, 16, 3), np.uint8) + np.array([170, 100, 230], np.uint8)
    mine = bw.Material(height=bumps(0.08, 1), albedo=checks, specular=0.0)
    yours = bw.Material(height=bw.HeightMap.procedural("bricks", 48, scale=0.05), albedo=(0.9, 0.3, 0.2))
    smooth = bw.Material(height=bumps(0.02, 2), normal=leaning, specular=0.8, shininess=60.0)
    ball, plate = bw.Mesh.sphere(0.4), bw.Mesh.quad(1.6)
    spin = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
    scene = [
        bw.Instance(ball, mine, moved(np.diag([1.2, 0.7, 0.9]), (-0.4, 0.1, 0.2))),
        bw.Instance(ball, yours, moved(spin @ np.diag([-0.6, 0.8, 1.0]), (0.35, -0.2, 0.3))),
        bw.Instance(plate, smooth, moved(np.eye(3), (0, 0, -0.2))),
        bw.Instance(bw.Mesh.cube(0.3), mine, moved(spin.T * 0.9, (0.1, 0.5, 0.2))),
    ]
    for technique, silhouettes in FEW[1:4:2]:
        option: dict[str, Any] = {"technique": technique, "silhouettes": silhouettes}
        whole = draw(scene, shadows=False, skip=False, **option)
        alone = [draw(one, shadows=False, skip=False, **option) for one in scene]
        depth = np.stack([sorted_by(f, one) for f, one in zip(alone, scene, strict=True)])
        front = depth.argmin(0)
        shown = np.isfinite(depth.min(0))
        composed = np.take_along_axis(np.stack([f.color for f in alone]), front[None, ..., None], 0)[0]
        np.testing.assert_array_equal(whole.aovs["mask"] > 0, shown)
        # Rounding decides between two objects that cut through each other.
        order = np.sort(depth, axis=0)
        clear = shown & (order[1] > np.where(shown, order[0], np.inf) + 1e-4)
        apart = np.abs(whole.color.astype(int) - composed).max(axis=2)
        assert apart[clear].max() <= 1, option
        assert len(np.unique(front[shown])) == 4
        # Negative control: the materials handed around.
        other = [
            bw.Instance(one.mesh, next_one.material, one.world_from_object)
            for one, next_one in zip(scene, [*scene[1:], scene[0]], strict=True)
        ]
        swapped = draw(other, shadows=False, skip=False, **option)
        assert (np.abs(swapped.color.astype(int) - composed).max(axis=2) > 8)[clear].mean() > 0.3


@pytest.mark.slow
@pytest.mark.parametrize(("technique", "silhouettes"), WAYS)
def test_a_million_units_away_everything_is_as_at_home(technique: str, silhouettes: bool) -> None:
    """Stretched, mirrored, shaded and cast upon; shifts that binary numbers do not hold exactly."""
    turn = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]) @ np.diag([1.3, 0.7, -0.9])
    ball, wall, rough = bw.Mesh.sphere(0.4), bw.Mesh.quad(1.5), bw.Material(height=bumps(0.06), specular=0.2)

    def picture(shift: NDArray[np.float64], to: type = np.float64) -> bw.Frame:
        return draw(
            [
                bw.Instance(ball, rough, moved(turn, np.add(shift, (0.1, 0.05, 0.5)).astype(to))),
                bw.Instance(wall, rough, moved(np.eye(3), shift.astype(to))),
            ],
            camera=bw.Camera.look_at(tuple(np.add(shift, (0.9, 0.7, 1.9))), tuple(shift), fov_y=40.0),
            lights=[bw.Light.point(tuple(np.add(shift, (1.0, 1.5, 2.0))), intensity=4.0)],
            technique=technique,
            silhouettes=silhouettes,
        )

    far = np.array((1e6, -1e6, 1e6 + 0.1))
    home, away = picture(np.zeros(3)), picture(far)
    np.testing.assert_array_equal(home.aovs["mask"], away.aovs["mask"])
    shown = home.aovs["mask"] > 0
    texels = np.abs(home.aovs["uv"] - away.aovs["uv"])[shown].max() * TEXELS
    depth = np.abs(away.aovs["depth"][shown] / home.aovs["depth"][shown] - 1).max()
    print(f"{technique} {silhouettes}: {texels:.2e} texels, depth {depth:.2e}")
    assert texels < 1e-3
    assert depth < 1e-6
    assert np.abs(home.aovs["normal"] - away.aovs["normal"])[shown].max() < 1e-3
    assert (np.abs(home.aovs["shadow"] - away.aovs["shadow"]) > 0.5)[shown].mean() < 1e-3
    assert np.quantile(np.abs(home.color.astype(int) - away.color), 0.999) <= 1
    # Negative control: in 32 bits the objects stand a few hundredths beside where they should.
    rounded = picture(far, np.float32)
    both = shown & (rounded.aovs["mask"] > 0)
    assert np.abs(home.aovs["depth"][both] - rounded.aovs["depth"][both]).max() > 1e-3
