"""Repairs and checks: promises kept on made maps, verdicts on real ones, settings refused."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw
from bumpwgpu.repair import DERIVATIVES

LEVELS = 255.0


def waves(width: int = 192, height: int = 128) -> NDArray[np.float64]:
    """A gentle surface that tiles: terraces many texels wide in 8 bits."""
    y, x = np.mgrid[:height, :width]
    u, v = 2 * np.pi * x / width, 2 * np.pi * y / height
    return np.asarray(0.5 + 0.08 * np.sin(u) * np.cos(v) + 0.05 * np.sin(2 * u + v))


def eight_bits(heights: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.rint(heights * LEVELS).astype(np.uint8)


def stored(vectors: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.floor(vectors * 127.5 + 128.0).clip(0, 255).astype(np.uint8)


def rms(a: NDArray[np.floating], b: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean((a.astype(np.float64) - b) ** 2)))


# dequantise


def test_stairs_become_slopes_and_round_back() -> None:
    truth = waves()
    source = bw.HeightMap(eight_bits(truth), scale=0.3, base=0.2, tile_size=(2.0, 1.0))
    smooth = bw.dequantise(source)
    assert (smooth.scale, smooth.base, smooth.tile_size, smooth.wrap) == (0.3, 0.2, (2.0, 1.0), "repeat")
    assert smooth.bits > 8
    for array in (smooth.array, np.rint(smooth.array * 65535.0) / 65535.0):
        np.testing.assert_array_equal(np.rint(array * LEVELS), np.rint(source.array * LEVELS))
    assert rms(smooth.array, truth) < 0.3 * rms(source.array, truth)
    rough, fine, exact = (bw.bake(hm)["normal"] for hm in (source, smooth, source_of(truth, source)))
    assert rms(fine, exact) < 0.2 * rms(rough, exact)


def source_of(truth: NDArray[np.float64], like: bw.HeightMap) -> bw.HeightMap:
    return bw.HeightMap(truth, scale=like.scale, base=like.base, tile_size=like.tile_size)


def test_levels_are_found_or_given() -> None:
    truth = waves(96, 64)
    metres = np.rint(truth * 400.0)
    found = bw.dequantise(metres, height_range="auto")
    assert found.bits > 9
    step = 1.0 / (metres.max() - metres.min())
    assert np.abs(found.array - (metres - metres.min()) * step).max() <= 0.5 * step
    coarse = bw.dequantise(bw.HeightMap(eight_bits(truth)), bits=4)
    assert np.abs(coarse.array - eight_bits(truth) / LEVELS).max() <= 0.5 / 15
    with pytest.raises(ValueError, match="no levels"):
        bw.dequantise(np.random.default_rng(1).random((40, 40)))


def test_nothing_to_smooth_is_said() -> None:
    flat = bw.HeightMap(np.full((4, 5), 7, np.uint8))
    with pytest.warns(bw.BumpWarning, match="one level"):
        assert bw.dequantise(flat) is flat
    fine = bw.HeightMap(np.arange(64, dtype=np.uint16).reshape(8, 8))
    with pytest.warns(bw.BumpWarning, match="16 bits"):
        np.testing.assert_array_equal(bw.dequantise(fine).array, fine.array)


def test_progress_reports_and_stops() -> None:
    source = bw.HeightMap(eight_bits(waves(512, 512)))
    seen: list[tuple[int, int]] = []
    bw.dequantise(source, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (512, 512)

    class Enough(Exception):
        pass

    def stop(done: int, total: int) -> None:
        raise Enough

    with pytest.raises(Enough):
        bw.dequantise(source, progress=stop)
    with pytest.raises(Enough):
        bw.heights_from_normals(bw.bake(source)["normal"], progress=stop)


def test_a_real_terrain_beats_the_input(assets: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bw.BumpWarning)
        truth = bw.HeightMap(assets / "panda3d" / "heightfield.png", wrap="clamp")
    source = bw.HeightMap(eight_bits(truth.array.astype(np.float64)), wrap="clamp")
    smooth = bw.dequantise(source)
    assert np.abs(smooth.array - source.array).max() <= 0.5 / LEVELS
    assert rms(smooth.array, truth.array) < 0.7 * rms(source.array, truth.array)


# tile_report


def test_seams() -> None:
    ramp = np.linspace(0, 1, 32) * np.ones((16, 1))
    report = bw.tile_report(ramp)
    assert (report.x.verdict, report.y.verdict, report.tiles) == ("seam", "tiles", False)
    assert report.x.step == pytest.approx(1.0)
    assert report.x.ratio == pytest.approx(31.0)
    assert "x: seam; step 31.00 x inside" in str(report)
    whole = bw.tile_report(bw.HeightMap(waves()))
    assert whole.tiles
    cut = bw.tile_report(waves()[:90])
    assert (cut.x.verdict, cut.y.verdict) == ("tiles", "seam")


def test_procedural_maps_tile() -> None:
    for name in bw.HeightMap.procedural_names():
        report = bw.tile_report(bw.HeightMap.procedural(name, 96))
        # The valley between two ridges lies on the edge.
        assert report.x.verdict == ("crease" if name == "ridge" else "tiles"), name
        assert report.y.verdict == "tiles", name


# heights_from_normals


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("convention", ["opengl", "directx"])
def test_there_and_back(convention: str, wrap: str) -> None:
    there = bw.HeightMap(waves(150, 101), scale=0.4, tile_size=(1.5, 1.0), wrap=wrap)
    normals = bw.bake(there, convention=convention)["normal"]
    span = there.array.max() - there.array.min()
    # At an edge that ends a bake knows one side only: its slope there is off by half.
    for image, limit in ((normals, 3e-3 if wrap == "repeat" else 1e-2), (stored(normals), 2e-2)):
        back = bw.heights_from_normals(
            image, convention=convention, wrap=wrap, tile_size=(1.5, 1.0), base=0.3
        )
        made = back.height_map
        assert (made.base, made.tile_size, made.wrap) == (0.3, (1.5, 1.0), wrap)
        assert made.scale == pytest.approx(0.4 * span, rel=limit)
        assert np.abs(made.array - (there.array - there.array.min()) / span).max() < limit
        assert back.residual < 1e-2
        assert back.mean_error < 0.5
    # Negative control: the other green channel leaves most of it unexplained.
    other = {"opengl": "directx", "directx": "opengl"}[convention]
    assert bw.heights_from_normals(normals, convention=other, wrap=wrap).residual > 0.1


def test_the_matching_kernel_is_the_best() -> None:
    there = bw.HeightMap.procedural("fbm", 96)
    normals = bw.bake(there, kernel="central")["normal"]
    errors = {kernel: bw.heights_from_normals(normals, kernel=kernel).mean_error for kernel in DERIVATIVES}
    assert set(errors) == {"spectral", "central", "sobel3", "sobel5", "scharr", "prewitt", "bilinear"}
    assert min(errors, key=errors.__getitem__) in ("central", "spectral")


def test_flat_codes_are_flat() -> None:
    # A map that ends, flat but for a dent: half a level of tilt would add up over its width.
    flat = np.tile(np.array([128, 128, 255], np.uint8), (64, 512, 1))
    back = bw.heights_from_normals(flat, wrap="clamp")
    assert back.height_map.scale == 0.0
    assert back.mean_slope == (0.0, 0.0)
    two = bw.heights_from_normals(flat[:, :, :2])
    assert two.height_map.scale == 0.0
    assert two.clipped == 0


# check_normals


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("convention", ["opengl", "directx"])
def test_every_reading_is_found(convention: str, swapped: bool) -> None:
    heights = bw.HeightMap.procedural("fbm", 128, scale=0.2)
    normals = bw.bake(heights, convention=convention)["normal"]
    if swapped:
        normals = np.ascontiguousarray(normals[:, :, [1, 0, 2]])
    image = stored(normals)
    alone, both = bw.check_normals(image), bw.check_normals(image, heights)
    for report in (alone, both):
        assert (report.convention, report.swapped) == (convention, swapped)
        assert report.confidence > 0.5
        assert report.not_unit < 0.1
        assert report.inward == 0.0
        assert convention in str(report)
    assert alone.heights is None
    assert both.heights is not None
    assert not both.heights.inverted
    assert both.heights.scale == pytest.approx(0.2, rel=0.02)
    assert both.heights.mean_error < 0.5 < both.heights.flat_error
    # Depths are told from heights.
    depths = bw.HeightMap(1.0 - heights.array, scale=0.2)
    upside = bw.check_normals(image, depths).heights
    assert upside is not None
    assert upside.inverted


def test_nothing_is_said_without_evidence() -> None:
    noise = np.random.default_rng(3).normal(size=(64, 64, 3)).astype(np.float32)
    noise[:, :, 2] = 2.0
    report = bw.check_normals(noise, bw.HeightMap.procedural("fbm", 64))
    assert report.convention is None
    assert report.swapped is None
    assert report.confidence == 0.0
    assert report.curl is not None
    assert not report.curl.decides
    assert "undecided" in str(report)
    assert "do not fit" in str(report)
    flat = bw.check_normals(np.zeros((8, 8, 2)))
    assert flat.curl is None
    assert flat.mean_length == 1.0


def test_real_pairs(assets: Path) -> None:
    for normals, heights, convention, inverted in (
        ("godot/texture_cheese_normal.png", "godot/texture_cheese_depth.png", "opengl", True),
        ("bevy/parallax_example/cube_normal.png", "bevy/parallax_example/cube_depth.png", "opengl", True),
        ("panda3d/layingrock-n.jpg", "panda3d/layingrock-h.jpg", "directx", True),
    ):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", bw.BumpWarning)
            report = bw.check_normals(assets / normals, assets / heights)
        assert report.convention == convention
        assert report.heights is not None
        assert report.heights.inverted == inverted
        assert report.curl is not None
        assert report.curl.convention == convention


# refusals


def test_refused(tmp_path: Path) -> None:
    hm = bw.HeightMap.procedural("dot", 16)
    normals = bw.bake(hm)["normal"]
    for bits in (0, 16, 8.0, True):
        with pytest.raises((ValueError, TypeError)):
            bw.dequantise(hm, bits=bits)
    with pytest.raises(TypeError, match="already"):
        bw.dequantise(hm, scale=1.0)
    with pytest.raises(TypeError, match="callable"):
        bw.dequantise(hm, bits=8, progress=3)
    with pytest.raises(TypeError, match="already"):
        bw.tile_report(hm, wrap="clamp")
    with pytest.raises(FileNotFoundError):
        bw.heights_from_normals(tmp_path / "absent.png")
    for wrong in (normals[:, :, 0], normals[:, :, :1], np.zeros((0, 4, 3)), np.zeros((4, 4, 5))):
        with pytest.raises(ValueError, match="shape"):
            bw.heights_from_normals(wrong)
        with pytest.raises(ValueError, match="shape"):
            bw.check_normals(wrong)
    for bad in (np.full((2, 2, 3), np.nan), np.full((2, 2, 3), 1e30)):
        with pytest.raises(ValueError, match="normals have"):
            bw.check_normals(bad)
    with pytest.raises(TypeError, match="uint8"):
        bw.check_normals(np.zeros((2, 2, 3), np.int64))
    with pytest.raises(ValueError, match="a side"):
        bw.check_normals(np.zeros((1, 65537, 3), np.uint8))
    for setting in ({"convention": "unreal"}, {"wrap": "border"}, {"kernel": "forward"}, {"steepest": 90}):
        with pytest.raises(ValueError):  # noqa: PT011
            bw.heights_from_normals(normals, **setting)
    for setting in ({"tile_size": 0}, {"base": 2.0}):
        with pytest.raises(ValueError, match=r"tile_size|base"):
            bw.heights_from_normals(normals, **setting)
    with pytest.raises(ValueError, match="wrap"):
        bw.check_normals(normals, wrap="border")


def test_any_size_and_odd_vectors() -> None:
    for shape in ((1, 1), (1, 7), (5, 1), (2, 2), (3, 4)):
        vectors = np.random.default_rng(5).normal(size=(*shape, 3))
        for wrap in ("repeat", "clamp", "mirror"):
            heights = bw.heights_from_normals(vectors, wrap=wrap).height_map.array
            assert heights.shape == shape
            assert np.isfinite(heights).all()
        assert np.isfinite(bw.check_normals(vectors).mean_length)
        levels = (np.abs(vectors[:, :, 0]) * 3).astype(np.uint8).clip(0, 15) * 17
        smooth = bw.dequantise(bw.HeightMap(levels), bits=4)
        assert np.abs(smooth.array - levels / 255).max() <= 0.5 / 15 + 1e-7
