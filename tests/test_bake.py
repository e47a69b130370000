"""bake: against convolutions and reductions in float64 NumPy, and what is saved against what was baked."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import bumpwgpu as bw
from bumpwgpu.baking import CONVENTIONS, KERNELS, MAPS, about, estimate

# Derivative along one axis and smoothing across it, taps from -2 to +2; from the published definitions.
TAPS = {
    "forward": ([0, 0, -1, 1, 0], [0, 0, 1, 0, 0]),
    "central": ([0, -0.5, 0, 0.5, 0], [0, 0, 1, 0, 0]),
    "sobel3": ([0, -0.5, 0, 0.5, 0], [0, 0.25, 0.5, 0.25, 0]),
    "sobel5": ([-1 / 8, -2 / 8, 0, 2 / 8, 1 / 8], [1 / 16, 4 / 16, 6 / 16, 4 / 16, 1 / 16]),
    "scharr": ([0, -0.5, 0, 0.5, 0], [0, 3 / 16, 10 / 16, 3 / 16, 0]),
    "prewitt": ([0, -0.5, 0, 0.5, 0], [0, 1 / 3, 1 / 3, 1 / 3, 0]),
    "bilinear": ([0, -0.5, 0, 0.5, 0], [0, 1 / 8, 6 / 8, 1 / 8, 0]),
}
# Component of a unit normal; measured 2e-7.
TOLERANCE = 1e-6
PAD = {"repeat": "wrap", "clamp": "edge", "mirror": "symmetric"}


def convolved(padded: NDArray[np.float64], down: list[float], across: list[float]) -> NDArray[np.float64]:
    rows, columns = padded.shape[0] - 4, padded.shape[1] - 4
    total = np.zeros((rows, columns))
    for j in range(5):
        for i in range(5):
            total += down[j] * across[i] * padded[j : j + rows, i : i + columns]
    return total


def normals(hm: bw.HeightMap, kernel: str) -> NDArray[np.float64]:
    """Unit normals in mesh units, +Y up the image."""
    padded = np.pad(hm.array.astype(np.float64), 2, mode=PAD[hm.wrap])
    derivative, smoothing = TAPS[kernel]
    rows, columns = hm.shape
    slope_x = hm.scale * convolved(padded, smoothing, derivative) * columns / hm.tile_size[0]
    slope_down = hm.scale * convolved(padded, derivative, smoothing) * rows / hm.tile_size[1]
    stacked = np.dstack((-slope_x, slope_down, np.ones(hm.shape)))
    return np.asarray(stacked / np.linalg.norm(stacked, axis=2, keepdims=True))


def rough(wrap: str = "repeat") -> bw.HeightMap:
    heights = bw.HeightMap.procedural("noise", (23, 18), seed=1).array
    return bw.HeightMap(heights, scale=0.07, tile_size=(1.5, 0.8), wrap=wrap)


@pytest.mark.parametrize("kernel", KERNELS)
def test_maps_wider_than_what_is_worked_on_at_a_time(kernel: str) -> None:
    rng = np.random.default_rng(7)
    for size in ((7, 64), (3, 65), (40, 130), (2, 511), (5, 513), (9, 1100)):
        for wrap in PAD:
            hm = bw.HeightMap(rng.random(size, dtype=np.float32), scale=0.02, wrap=wrap)
            baked = bw.bake(hm, kernel=kernel)["normal"]
            np.testing.assert_allclose(baked, normals(hm, kernel), atol=TOLERANCE, err_msg=f"{size} {wrap}")


def test_the_table_lists_every_kernel() -> None:
    assert set(TAPS) == set(KERNELS)


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("kernel", KERNELS)
def test_normals(kernel: str, wrap: str) -> None:
    hm = rough(wrap)
    baked = bw.bake(hm, kernel=kernel)["normal"]
    assert baked.dtype == np.float32
    assert baked.shape == (18, 23, 3)
    np.testing.assert_allclose(baked, normals(hm, kernel), atol=TOLERANCE)


def test_the_comparison_can_fail() -> None:
    """Negative control: each kernel differs from each other one by more than the tolerance."""
    hm = rough()
    for kernel in KERNELS:
        for other in KERNELS:
            if kernel != other:
                difference = np.abs(bw.bake(hm, kernel=kernel)["normal"] - normals(hm, other))
                assert difference.max() > 1e3 * TOLERANCE


def test_which_way_is_up() -> None:
    # Higher towards the bottom of the image: the surface faces up the image, +Y.
    hm = bw.HeightMap(np.linspace(0, 1, 16)[:, None].repeat(8, 1), wrap="clamp")
    opengl = bw.bake(hm)["normal"][8, 4]
    directx = bw.bake(hm, convention="directx")["normal"][8, 4]
    assert opengl[0] == 0
    assert opengl[1] > 0.05
    np.testing.assert_array_equal(directx, opengl * [1, -1, 1])
    # Higher towards the right: faces left.
    assert bw.bake(bw.HeightMap(hm.array.T, wrap="clamp"))["normal"][4, 8, 0] < -0.05


def test_maps_agree_with_each_other() -> None:
    hm = rough()
    maps = bw.bake(hm, maps=MAPS)
    assert list(maps) == list(MAPS)
    assert len(maps) == len(MAPS)
    np.testing.assert_array_equal(maps["normal_xy"], maps["normal"][:, :, :2])
    np.testing.assert_array_equal(maps["relief"][:, :, :3], maps["normal"])
    np.testing.assert_array_equal(maps["relief"][:, :, 3], hm.array)
    assert "normal (18, 23, 3)" in repr(maps)
    with pytest.raises(KeyError):
        maps["cones"]


@pytest.mark.parametrize("size", [(16, 16), (23, 18), (1, 7), (1, 1), (5, 1)])
def test_pyramid(size: tuple[int, int]) -> None:
    heights = bw.HeightMap.procedural("noise", size, seed=2).array
    levels = bw.bake(bw.HeightMap(heights), "pyramid")["pyramid"]
    corners = np.stack([np.roll(heights, (-j, -i), (0, 1)) for j in (0, 1) for i in (0, 1)], axis=2)
    low, high = corners.min(axis=2), corners.max(axis=2)
    for level in levels:
        np.testing.assert_array_equal(level, np.dstack((low, high)))
        rows, columns = (low.shape[0] + 1) // 2, (low.shape[1] + 1) // 2
        blocks = [
            (slice(2 * j, 2 * j + 2), slice(2 * i, 2 * i + 2)) for j in range(rows) for i in range(columns)
        ]
        low = np.array([low[block].min() for block in blocks]).reshape(rows, columns)
        high = np.array([high[block].max() for block in blocks]).reshape(rows, columns)
    assert levels[-1].shape == (1, 1, 2)
    np.testing.assert_array_equal(levels[-1][0, 0], [heights.min(), heights.max()])


def test_other_sources(tmp_path: Path) -> None:
    heights = (np.arange(64, dtype=np.uint8) * 4).reshape(8, 8)
    path = tmp_path / "map.png"
    Image.fromarray(heights).save(path)
    expected = bw.bake(bw.HeightMap(heights, scale=0.3, wrap="clamp"))["normal"]
    for source in (path, str(path), heights, Image.fromarray(heights)):
        np.testing.assert_array_equal(bw.bake(source, scale=0.3, wrap="clamp")["normal"], expected)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("bits", [8, 16])
def test_saved_normals(bits: int, convention: str, tmp_path: Path) -> None:
    maps = bw.bake(rough(), maps=("normal", "relief"), convention=convention)
    paths = maps.save(tmp_path / "new" / "folder", bits=bits)
    assert [path.name for path in paths] == ["normal.png", "relief.png"]
    for path in paths:
        channels = [bw.HeightMap(path, channel=c).array for c in range(3)]
        decoded = np.dstack(channels) * 2.0 - 1.0
        # Half a level of the encoding, and the rounding of float32.
        assert np.abs(decoded - maps["normal"]).max() <= 1.0 / (2**bits - 1) + 1e-6
    height = bw.HeightMap(paths[1], channel="a").array
    assert np.abs(height - maps["relief"][:, :, 3]).max() <= 0.5 / (2**bits - 1) + 1e-6


def test_a_flat_map_in_eight_bits(tmp_path: Path) -> None:
    path = bw.bake(bw.HeightMap.procedural("flat", 4)).save(tmp_path)[0]
    with Image.open(path) as image:
        assert np.asarray(image).reshape(-1, 3).tolist() == [[128, 128, 255]] * 16


@pytest.mark.parametrize("format", ["exr", "npy"])
def test_saved_floats_are_exact(format: str, tmp_path: Path) -> None:
    maps = bw.bake(rough(), maps=("normal", "pyramid"))
    paths = maps.save(tmp_path, format=format, prefix="wall")
    assert paths[0].name == f"wall_normal.{format}"
    assert [path.name for path in paths[1:3]] == [f"wall_pyramid_00.{format}", f"wall_pyramid_01.{format}"]
    if format == "npy":
        np.testing.assert_array_equal(np.load(paths[0]), maps["normal"])
        np.testing.assert_array_equal(np.load(paths[2]), maps["pyramid"][1])
    else:
        low, high = (bw.HeightMap(paths[2], channel=c).array for c in ("R", "G"))
        np.testing.assert_array_equal(np.dstack((low, high)), maps["pyramid"][1])


def test_saved_pyramids_stay_bounds(tmp_path: Path) -> None:
    levels = bw.bake(rough(), "pyramid")
    for path, level in zip(levels.save(tmp_path), levels["pyramid"], strict=True):
        low, high = (bw.HeightMap(path, channel=c).array for c in ("r", "g"))
        assert (low <= level[:, :, 0] + 1e-7).all()
        assert (high >= level[:, :, 1] - 1e-7).all()


def test_progress_counts_up_to_the_end() -> None:
    seen: list[tuple[int, int]] = []
    bw.bake(rough(), MAPS, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (18 * len(MAPS), 18 * len(MAPS))
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})


def test_an_exception_from_progress_stops_the_bake() -> None:
    class Enough(Exception):
        pass

    def progress(done: int, total: int) -> None:
        raise Enough

    with pytest.raises(Enough):
        bw.bake(rough(), progress=progress)


def test_progress_may_bake_itself() -> None:
    inner: list[int] = []
    bw.bake(rough(), progress=lambda *_: inner.append(len(bw.bake(rough()))))
    assert inner


def test_options_of_maps() -> None:
    hm = rough()
    with pytest.warns(bw.BumpWarning, match=r"kernel has no effect.*only normal, normal_xy, relief"):
        bw.bake(hm, "pyramid", kernel="scharr")
    with pytest.raises(ValueError, match="scharr"):
        bw.bake(hm, "pyramid", kernel="roberts")
    with pytest.raises(
        TypeError, match=r"unexpected options kernal; normal, pyramid takes kernel, convention"
    ):
        bw.bake(hm, ("normal", "pyramid"), kernal="scharr")
    with pytest.raises(TypeError, match="pyramid takes no options"):
        bw.bake(hm, "pyramid", colour=3)
    with pytest.raises(TypeError, match="string"):
        bw.bake(hm, kernel=3)


def test_every_map_is_described() -> None:
    hm = rough()
    for name in MAPS:
        info = about(name)
        assert info.summary
        assert info.source
        made = bw.bake(hm, name, **{option.name: option.default for option in info.options})[name]
        layers = made if info.form == "levels" else (made,)
        ndim = 2 + (len(info.channels) > 1) + (info.form == "stack")
        assert all(layer.ndim == ndim and layer.dtype == np.float32 for layer in layers)
        size, working = estimate((23, 18), name)
        assert size == sum(layer.nbytes for layer in layers)
        assert working >= 0
        for at, channel in enumerate(info.channels):
            if channel.range is not None:
                planes = [layer if len(info.channels) == 1 else layer[..., at] for layer in layers]
                low, high = channel.range
                assert all(low <= plane.min() and plane.max() <= high for plane in planes), name
        for option in info.options:
            assert option.describe()
            with pytest.raises(TypeError):
                option.check(None)
    with pytest.raises(ValueError, match="normal, normal_xy"):
        about("cones")
    with pytest.raises(ValueError, match="size"):
        estimate((0, 4), "normal")


def test_refused(tmp_path: Path) -> None:
    hm = rough()
    for maps in ("cones", ("normal", "horizons"), ""):
        with pytest.raises(ValueError, match="normal, normal_xy, relief, pyramid"):
            bw.bake(hm, maps)
    with pytest.raises(ValueError, match="empty"):
        bw.bake(hm, ())
    with pytest.raises(ValueError, match="scharr"):
        bw.bake(hm, kernel="roberts")
    with pytest.raises(ValueError, match="directx"):
        bw.bake(hm, convention="unreal")
    with pytest.raises(TypeError, match="already"):
        bw.bake(hm, scale=2)
    with pytest.raises(ValueError, match="detail="):
        bw.bake(bw.Mesh.quad())
    with pytest.raises(TypeError, match="callable"):
        bw.bake(hm, progress=3)
    for maps in (3, [3]):
        with pytest.raises(TypeError):
            bw.bake(hm, maps)
    baked = bw.bake(hm)
    with pytest.raises(ValueError, match="png, tiff, exr, npy"):
        baked.save(tmp_path, format="gif")
    with pytest.raises(ValueError, match="8, 16 or 32"):
        baked.save(tmp_path, bits=12)
    for prefix in ("../up", "a\\b", "a\0b"):
        with pytest.raises(ValueError, match="prefix"):
            baked.save(tmp_path, prefix=prefix)
    with pytest.warns(bw.BumpWarning, match="floats"):
        baked.save(tmp_path / "floats", format="exr", bits=8)
    (tmp_path / "file").write_text("here already")
    with pytest.raises(bw.BakeError, match="not a folder"):
        baked.save(tmp_path / "file")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "floats"]


def test_a_failed_save_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "normal.png").mkdir()
    with pytest.raises((bw.BakeError, OSError)):
        bw.bake(rough()).save(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["normal.png"]


def test_against_openimageio(assets: Path) -> None:
    """bumpslope-central.exr: OpenImageIO's own central slopes of the height it stores, edge clamped."""
    path = assets / "oiio_golden" / "bumpslope-central.exr"
    if not path.exists():
        pytest.skip(f"no {path}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        hm = bw.HeightMap(path, channel="b0_h", wrap="clamp", scale=1.0)
        # Slopes a texel, as OpenImageIO stores them.
        hm = hm.replace(tile_size=hm.shape[::-1])
        # Slopes may be negative: read them through a range they fit into.
        read = {
            name: bw.HeightMap(path, channel=name, height_range=(-2, 2)).array * 4.0 - 2.0
            for name in ("b1_dhds", "b2_dhdt")
        }
    normal = bw.bake(hm, kernel="central")["normal"]
    slopes = -normal[:, :, :2] / normal[:, :, 2:]
    np.testing.assert_allclose(slopes[:, :, 0], read["b1_dhds"], atol=2e-3)
    np.testing.assert_allclose(-slopes[:, :, 1], read["b2_dhdt"], atol=2e-3)
