"""Several samples a pixel, and highlights of reliefs seen from afar."""

from __future__ import annotations

import numpy as np
import pytest

import bumpwgpu as bw

pytestmark = pytest.mark.gpu


def linear(color: np.ndarray) -> np.ndarray:
    value = color[..., :3] / 255.0
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def averaged(picture: np.ndarray, side: int) -> np.ndarray:
    h, w, c = picture.shape
    return picture.reshape(h // side, side, w // side, side, c).mean((1, 3))


STEPS = bw.HeightMap((np.indices((32, 32)).sum(0) // 4 % 2).astype(np.float32), scale=0.1)
CAMERA = bw.Camera.look_at((0.4, -0.6, 1.1), (0, 0, 0), up=(0, 1, 0))


@pytest.mark.parametrize(("technique", "silhouettes"), [("exact", True), ("relief", False)])
@pytest.mark.parametrize("samples", [4, 16])
def test_samples_are_averaged_in_linear_light(technique: str, silhouettes: bool, samples: int) -> None:
    common = {"camera": CAMERA, "technique": technique, "silhouettes": silhouettes}
    material = bw.Material(height=STEPS)
    one = bw.render(bw.Mesh.quad(), material, size=32, aovs=("depth", "uv", "mask"), **common)
    several = bw.render(
        bw.Mesh.quad(), material, size=32, samples=samples, aovs=("depth", "uv", "mask"), **common
    )
    side = int(np.sqrt(samples))
    fine = bw.render(bw.Mesh.quad(), material, size=32 * side, **common)
    covered = averaged(fine.color[..., 3:] / 255.0, side)[..., 0] == 1
    truth = averaged(linear(fine.color), side)
    assert covered.sum() > 200
    assert np.abs(linear(several.color) - truth)[covered].max() < 0.005
    # Negative control: the edges inside the relief.
    assert np.abs(linear(one.color) - truth)[covered].max() > 0.1
    for name in ("depth", "uv", "mask"):
        np.testing.assert_array_equal(one.aovs[name], several.aovs[name])


def test_senseless_samples_are_refused() -> None:
    for samples in (0, 2, 3, -1, True, "four", 4.5):
        with pytest.raises(ValueError, match="samples must be 1, 4 or 16"):
            bw.render(bw.Mesh.quad(), size=8, samples=samples)


def glints(
    heights: bw.HeightMap, shininess: float, size: int, shift: float = 0.0, **options: object
) -> np.ndarray:
    gloss = bw.Material(height=heights, albedo=(0.0, 0.0, 0.0), specular=1.0, shininess=shininess)
    frame = bw.render(
        bw.Mesh.quad(),
        gloss,
        camera=bw.Camera.look_at((0.1 + shift, -0.3, 2.4), (0.1 + shift, 0.0, 0), up=(0, 1, 0), fov_y=20.0),
        lights=[bw.Light.directional((0.1, 0.3, -2.4), intensity=0.3)],
        technique="normal",
        size=size,
        ambient=0.0,
        **options,  # type: ignore[arg-type]
    )
    return linear(frame.color)


NOISE = bw.HeightMap(np.random.default_rng(1).random((256, 256), dtype=np.float32), scale=0.002)
# Grooves a few texels wide, along v only and along both.
ALONG = np.sin(2 * np.pi * 37.3 * (np.arange(256) + 0.5) / 256)
GROOVES = bw.HeightMap((0.5 + 0.5 * ALONG * np.ones((256, 1))).astype(np.float32), scale=0.0008)
CROSSED = bw.HeightMap((0.5 + 0.25 * (ALONG + ALONG[:, None])).astype(np.float32), scale=0.0016)


@pytest.mark.parametrize("shininess", [20.0, 100.0, 500.0])
@pytest.mark.parametrize("relief", ["noise", "grooves", "crossed"])
def test_highlights_from_afar_are_as_wide_and_as_bright_as_their_slopes_make_them(
    relief: str, shininess: float
) -> None:
    """256 samples a pixel of the map's own texels are the truth; 64 texels a pixel are what is drawn."""
    heights = {"noise": NOISE, "grooves": GROOVES, "crossed": CROSSED}[relief]
    truth = averaged(glints(heights, shininess, 512, specular_aa=False), 16)
    with_aa, without = (glints(heights, shininess, 32, specular_aa=on) for on in (True, False))
    energy = truth.mean()
    off, plain = (abs(drawn.mean() / energy - 1) for drawn in (with_aa, without))
    error, plain_error = (np.sqrt(((drawn - truth) ** 2).mean()) / energy for drawn in (with_aa, without))
    print(f"{relief} {shininess:3.0f}: light off by {off:.3f}, pixels by {error:.3f}")
    print(f"    without antialiasing {plain:.3f}, {plain_error:.3f}")
    assert energy > 0.001
    # The narrower a lobe beside the slopes, the more there is to gain. Slopes of waves are no Gaussian's.
    assert off < (0.02 if relief == "noise" or shininess < 200 else 0.12)
    assert error < {20.0: 0.9, 100.0: 0.5, 500.0: 0.4}[shininess] * plain_error
    assert plain > max(2 * off, 0.02), "negative control"


@pytest.mark.parametrize("shininess", [100.0, 500.0, 2000.0])
def test_highlights_do_not_flicker(shininess: float) -> None:
    """A camera that moves by an eighth of a pixel each time: what changes from picture to picture, against
    64 samples a pixel of the map's own texels."""

    def flicker(side: int, **options: object) -> float:
        pixel = 2 * 2.4 * np.tan(np.radians(10.0)) / 64
        pictures = [
            averaged(glints(NOISE, shininess, 64 * side, 0.13 * k * pixel, **options), side) for k in range(4)
        ]
        return float(np.sqrt(np.mean(np.diff(pictures, axis=0) ** 2)) / np.mean(pictures))

    real, with_aa = flicker(8, specular_aa=False), flicker(1)
    without = flicker(1, specular_aa=False)
    print(
        f"{shininess:4.0f}: {real:.4f} in the truth, {with_aa:.4f} with antialiasing, {without:.4f} without"
    )
    assert with_aa < 1.2 * real
    # Negative control; beside a lobe as wide as that of 100 the averaged slopes are small.
    assert without > {100.0: 0.7, 500.0: 1.2, 2000.0: 3.0}[shininess] * real


@pytest.mark.parametrize(
    ("technique", "silhouettes"),
    [("exact", True), ("exact", False), ("relief", False), ("displacement", False)],
)
def test_steps_have_no_seam_of_wrong_detail(technique: str, silhouettes: bool) -> None:
    """A map of black and white halves, larger than its texels, lit from everywhere: what is neither
    black nor white off the borders of the halves was read from a level that is too coarse."""
    halves = np.zeros((256, 256), np.uint8)
    halves[:, 128:] = 255
    frame = bw.render(
        bw.Mesh.quad(),
        bw.Material(height=STEPS, albedo=halves),
        camera=CAMERA,
        technique=technique,
        silhouettes=silhouettes,
        size=256,
        ambient=1.0,
        lights=[],
        shadows=False,
        aovs=("uv", "mask"),
    )
    uv, covered = frame.aovs["uv"], frame.aovs["mask"] == 1
    # Two texels away from where the halves meet.
    off = covered & (np.abs((uv[..., 0] % 0.5) - 0.25) < 0.25 - 2 / 256)
    grey = np.abs(frame.color[..., 0] - 127.5) < 125
    assert off.sum() > 10_000
    assert not (grey & off).any()
    # Negative control: from one pixel to the next, as derivatives along the screen are taken, places jump.
    jumps = np.linalg.norm(np.diff(uv, axis=1), axis=2) * 256
    assert (jumps[covered[:, 1:] & covered[:, :-1]] > 8).sum() > 100
