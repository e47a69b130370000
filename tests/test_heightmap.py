"""HeightMap: what goes in, what comes out, what is refused; and the procedural maps."""

from __future__ import annotations

import copy
import pickle
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import bumpwgpu as bw

RAMP8 = np.arange(256, dtype=np.uint8).reshape(16, 16)
RAMP16 = np.linspace(0, 65535, 15 * 17).round().astype(np.uint16).reshape(15, 17)


def quiet(*args: Any, **kwargs: Any) -> bw.HeightMap:
    """A height map that must not warn."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return bw.HeightMap(*args, **kwargs)


def test_defaults_and_properties() -> None:
    hm = quiet(RAMP8)
    assert (hm.scale, hm.base, hm.tile_size, hm.wrap) == (0.1, 1.0, (1.0, 1.0), "repeat")
    assert hm.shape == (16, 16)
    assert hm.array.dtype == np.float32
    assert not hm.array.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        hm.array[0, 0] = 1
    with pytest.raises(AttributeError):
        hm.scale = 2.0
    assert repr(hm) == ("<HeightMap 16 x 16, 8 bits, scale=0.1, base=1, tile_size=(1, 1), wrap='repeat'>")
    assert quiet(RAMP8, tile_size=2).tile_size == (2.0, 2.0)


def test_the_source_is_copied() -> None:
    source = np.zeros((4, 4), np.float32)
    hm = quiet(source)
    source[:] = 1
    assert hm.array.max() == 0
    assert source.flags.writeable


@pytest.mark.parametrize(
    ("values", "expected", "bits"),
    [
        (RAMP8, RAMP8 / 255, 8),
        (RAMP16, RAMP16 / 65535, 16),
        (RAMP8.astype(np.uint16) * 257, RAMP8 / 255, 8),
        (RAMP8 > 100, RAMP8 > 100, 1),
        ((RAMP8 / 255).astype(np.float32), RAMP8 / 255, 8),
        (np.sqrt(RAMP8 / 256), np.sqrt(RAMP8 / 256), 32),
        ((RAMP8 / 255).astype(np.float16), RAMP8 / 255, 8),
        (RAMP8[::2, 1::3], RAMP8[::2, 1::3] / 255, 8),
        (RAMP8.tolist()[0:1] and [[0.0, 0.5], [1.0, 0.25]], np.array([[0, 0.5], [1, 0.25]]), 2),
    ],
    ids=["u8", "u16", "u8 in u16", "bool", "f32", "f64", "f16", "strided", "list"],
)
def test_arrays(values: Any, expected: Any, bits: int) -> None:
    hm = quiet(values)
    # The two half-precision roundings leave 2.5e-4.
    tolerance = 3e-4 if getattr(values, "dtype", None) == np.float16 else 1e-7
    np.testing.assert_allclose(hm.array, expected, atol=tolerance)
    assert hm.bits == bits


def test_invert_and_height_range() -> None:
    metres = np.array([[236, 500], [1076, 700]], np.int16)
    np.testing.assert_allclose(quiet(metres, height_range="auto").array, (metres - 236) / 840, atol=1e-7)
    np.testing.assert_allclose(quiet(metres, height_range=(0, 2000)).array, metres / 2000, atol=1e-7)
    np.testing.assert_allclose(quiet(RAMP8, invert=True).array, 1 - RAMP8 / 255, atol=1e-7)
    # Integers count in their own units.
    assert quiet(RAMP8, height_range=(0, 510)).array.max() == 0.5
    with pytest.warns(bw.BumpWarning, match="row 0, column 0: 236"):
        clipped = bw.HeightMap(metres, height_range=(300, 2000))
    assert clipped.array[0, 0] == 0
    with pytest.warns(bw.BumpWarning, match="constant"):
        assert bw.HeightMap([[7, 7]], height_range="auto").array.max() == 0
    huge = np.array([[-1e308, 1e308]])
    with pytest.raises(ValueError, match="too wide"):
        bw.HeightMap(huge, height_range="auto")


def test_resampling_overshoot_is_clipped_with_a_warning() -> None:
    with pytest.warns(bw.BumpWarning, match="clipped"):
        hm = bw.HeightMap(np.array([[-0.004, 0.5], [1.006, 1.0]]))
    assert hm.array.min() == 0
    assert hm.array.max() == 1


BAD: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "NaN": (lambda: bw.HeightMap([[0.0, np.nan]]), ValueError, "row 0, column 1 is nan"),
    "infinite": (lambda: bw.HeightMap([[0.0], [-np.inf]]), ValueError, "row 1, column 0 is -inf"),
    "too high": (lambda: bw.HeightMap([[0.0, 1.5]]), ValueError, 'height_range="auto"'),
    "integers": (lambda: bw.HeightMap([[0, 1500]]), ValueError, "int64 from 0 to 1500"),
    "empty": (lambda: bw.HeightMap(np.empty((0, 5))), ValueError, "empty"),
    "no channels": (lambda: bw.HeightMap(np.empty((4, 5, 0))), ValueError, "empty"),
    "line": (lambda: bw.HeightMap([0.1, 0.2]), ValueError, "shape"),
    "4-D": (lambda: bw.HeightMap(np.zeros((2, 2, 2, 2))), ValueError, "shape"),
    "number": (lambda: bw.HeightMap(0.5), ValueError, "shape"),
    "ragged": (lambda: bw.HeightMap([[1, 2], [3]]), TypeError, "not an array"),
    "text": (lambda: bw.HeightMap([["a"]]), TypeError, "array of numbers"),
    "none": (lambda: bw.HeightMap(None), TypeError, "NoneType"),
    "bytes": (lambda: bw.HeightMap(b"abc"), TypeError, "bytes"),
    "complex": (lambda: bw.HeightMap(np.zeros((2, 2), complex)), TypeError, "complex"),
    "masked": (lambda: bw.HeightMap(np.ma.masked_less(np.zeros((2, 2)), 1)), ValueError, "masked"),
    "too long": (lambda: bw.HeightMap(np.zeros((1, 65537))), ValueError, "at most 65536"),
    "RGB": (lambda: bw.HeightMap(np.eye(3)[None].repeat(3, 0)), ValueError, "channel"),
    "channel 5": (lambda: bw.HeightMap(np.zeros((2, 2, 3)), channel=5), ValueError, "does not exist"),
    "channel x": (lambda: bw.HeightMap(np.zeros((2, 2, 3)), channel="x"), ValueError, '"r", "g"'),
    "channel type": (lambda: bw.HeightMap(np.zeros((2, 2, 3)), channel=1.5), TypeError, "channel"),
    "channel -1": (lambda: bw.HeightMap(np.zeros((2, 2, 3)), channel=-1), ValueError, "does not exist"),
    "scale": (lambda: bw.HeightMap(RAMP8, scale=-1), ValueError, "invert=True"),
    "scale NaN": (lambda: bw.HeightMap(RAMP8, scale=float("nan")), ValueError, "finite"),
    "scale huge": (lambda: bw.HeightMap(RAMP8, scale=1e300), ValueError, "32-bit"),
    "scale vast": (lambda: bw.HeightMap(RAMP8, scale=10**400), ValueError, "32-bit"),
    "scale text": (lambda: bw.HeightMap(RAMP8, scale="1"), TypeError, "number"),
    "base": (lambda: bw.HeightMap(RAMP8, base=1.5), ValueError, "0..1"),
    "tile": (lambda: bw.HeightMap(RAMP8, tile_size=0), ValueError, "positive"),
    "tile tiny": (lambda: bw.HeightMap(RAMP8, tile_size=1e-300), ValueError, "positive"),
    "tile 3": (lambda: bw.HeightMap(RAMP8, tile_size=(1, 1, 1)), ValueError, "two"),
    "wrap": (lambda: bw.HeightMap(RAMP8, wrap="tile"), ValueError, "mirror"),
    "wrap type": (lambda: bw.HeightMap(RAMP8, wrap=1), TypeError, "string"),
    "invert": (lambda: bw.HeightMap(RAMP8, invert="no"), TypeError, "invert"),
    "range word": (lambda: bw.HeightMap(RAMP8, height_range="all"), ValueError, "auto"),
    "range order": (lambda: bw.HeightMap(RAMP8, height_range=(1, 1)), ValueError, "low < high"),
    "range type": (lambda: bw.HeightMap(RAMP8, height_range=3), TypeError, "auto"),
    "again": (lambda: bw.HeightMap(quiet(RAMP8)), TypeError, "replace"),
    "missing": (lambda: bw.HeightMap("nowhere.png"), FileNotFoundError, "nowhere.png"),
    "missing npy": (lambda: bw.HeightMap("nowhere.npy"), FileNotFoundError, "nowhere.npy"),
    "npz": (lambda: bw.HeightMap("some.npz"), ValueError, "several arrays"),
    "null path": (lambda: bw.HeightMap("a\0b.png"), ValueError, "null"),
}


@pytest.mark.parametrize("name", BAD)
def test_refused(name: str) -> None:
    call, kind, message = BAD[name]
    with pytest.raises(kind, match=message):
        call()


def test_channels() -> None:
    rng = np.random.default_rng(0)
    rgba = rng.integers(0, 256, (5, 7, 4), dtype=np.uint8)
    for at, name in enumerate("rgba"):
        expected = rgba[:, :, at] / np.float32(255)
        np.testing.assert_array_equal(quiet(rgba, channel=name).array, expected)
        np.testing.assert_array_equal(quiet(rgba, channel=at).array, expected)
    grey = RAMP8[:, :, None].repeat(3, 2)
    np.testing.assert_array_equal(quiet(grey).array, quiet(RAMP8).array)
    opaque = np.dstack((grey, np.full_like(RAMP8, 255)))
    np.testing.assert_array_equal(quiet(opaque).array, quiet(RAMP8).array)
    with pytest.raises(ValueError, match="4 channels that differ"):
        bw.HeightMap(np.dstack((grey, RAMP8.T)))
    grey_alpha = np.dstack((RAMP8, np.full_like(RAMP8, 255)))
    np.testing.assert_array_equal(quiet(grey_alpha).array, quiet(RAMP8).array)
    assert quiet(grey_alpha, channel="a").array.min() == 1


@pytest.mark.parametrize("suffix", ["png", "tiff", "bmp", "npy"])
def test_eight_bit_files(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"map.{suffix}"
    if suffix == "npy":
        np.save(path, RAMP8)
    else:
        Image.fromarray(RAMP8).save(path)
    for source in (path, str(path)):
        hm = quiet(source)
        np.testing.assert_allclose(hm.array, RAMP8 / 255, atol=1e-7)
        assert hm.bits == 8


@pytest.mark.parametrize("suffix", ["png", "tiff"])
def test_sixteen_bit_files(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"map.{suffix}"
    Image.fromarray(RAMP16).save(path)
    hm = quiet(path)
    assert hm.shape == (15, 17)
    np.testing.assert_allclose(hm.array, RAMP16 / 65535, atol=1e-7)
    assert hm.bits == 16


def test_float_tiff(tmp_path: Path) -> None:
    path = tmp_path / "map.tiff"
    values = np.sqrt(RAMP8 / np.float32(255)).astype(np.float32)
    Image.fromarray(values).save(path)
    np.testing.assert_array_equal(quiet(path).array, values)


def test_exr_round_trip(tmp_path: Path) -> None:
    source = bw.HeightMap.procedural("fbm", (12, 9))
    path = bw.bake(source, "relief").save(tmp_path, format="exr")[0]
    np.testing.assert_array_equal(quiet(path, channel="A").array, source.array)


def test_lossy_files_warn(tmp_path: Path) -> None:
    path = tmp_path / "map.jpg"
    Image.fromarray(RAMP8).save(path, quality=95)
    with pytest.warns(bw.BumpWarning, match="map.jpg"):
        bw.HeightMap(path)
    with Image.open(path) as image, pytest.warns(bw.BumpWarning, match="JPEG"):
        bw.HeightMap(image)


def test_damaged_files(tmp_path: Path) -> None:
    good = tmp_path / "good.png"
    Image.fromarray(RAMP8).save(good)
    data = good.read_bytes()
    for name, content in {"cut.png": data[:60], "empty.png": b"", "text.png": b"hello world"}.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(bw.BakeError, match=name):
            bw.HeightMap(tmp_path / name)
    with pytest.raises(bw.BakeError):
        bw.HeightMap(tmp_path)


def test_damaged_npy(tmp_path: Path) -> None:
    path = tmp_path / "map.npy"
    np.save(path, np.zeros((4, 4)))
    data = path.read_bytes()
    bad = {
        "cut": data[:-8],
        "header only": data[:20],
        "empty": b"",
        "vast": data.replace(b"(4, 4)", b"(9999999999, 9999999999)"[:6].ljust(6)),
        "other": b"\x93NUMPY\x09\x00" + data[8:],
    }
    for content in bad.values():
        path.write_bytes(content)
        with pytest.raises(bw.BakeError, match=r"map\.npy"):
            bw.HeightMap(path)
    np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(bw.BakeError, match="objects"):
        bw.HeightMap(path)
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (99999999, 99999999), }"
    header = header.ljust(117) + b"\n"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(bw.BakeError, match="announces"):
        bw.HeightMap(path)


@pytest.mark.parametrize("mode", ["L", "I;16", "F", "1", "RGB", "RGBA", "LA", "P", "CMYK"])
def test_pil_modes(mode: str) -> None:
    eight = Image.fromarray(RAMP8)
    tolerance = 1e-7
    if mode == "I;16":
        image, expected = Image.fromarray(RAMP16), RAMP16 / 65535
    elif mode == "F":
        image, expected = Image.fromarray((RAMP8 / 255).astype(np.float32)), RAMP8 / 255
    elif mode == "1":
        image, expected = eight.point(lambda v: 255 * (v > 99)).convert("1"), RAMP8 > 99
    elif mode == "P":
        image, expected = eight.quantize(256), RAMP8 / 255
        tolerance = 2 / 255
    else:
        image, expected = eight.convert(mode), RAMP8 / 255
        tolerance = 1.01 / 255
    assert image.mode == mode
    np.testing.assert_allclose(quiet(image).array, expected, atol=tolerance)


def test_sixteen_bit_png_through_pil(tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    Image.fromarray(RAMP16).save(path)
    with Image.open(path) as image:
        np.testing.assert_allclose(quiet(image).array, RAMP16 / 65535, atol=1e-7)


def test_srgb_tag_warns() -> None:
    image = Image.fromarray(RAMP8)
    image.info["srgb"] = 0
    with pytest.warns(bw.BumpWarning, match="sRGB"):
        bw.HeightMap(image)


def test_replace_shares_the_heights() -> None:
    hm = quiet(RAMP8, wrap="mirror")
    other = hm.replace(scale=0.5, tile_size=(2, 1))
    assert (other.scale, other.base, other.tile_size, other.wrap) == (0.5, 1.0, (2.0, 1.0), "mirror")
    assert other.array is hm.array
    assert hm.scale == 0.1
    with pytest.raises(ValueError, match="base"):
        hm.replace(base=-1)


def test_pickle_and_copy() -> None:
    hm = quiet(RAMP16, scale=0.3, wrap="clamp")
    for other in (pickle.loads(pickle.dumps(hm)), copy.copy(hm), copy.deepcopy(hm)):
        np.testing.assert_array_equal(other.array, hm.array)
        assert (other.scale, other.wrap, other.bits) == (0.3, "clamp", 16)


# Slope across the border against the steepest slope inside, for the maps that are meant to be smooth.
SMOOTH = ("fbm", "sines", "spheres", "cones", "ridge", "terrain", "sinc", "bricks")


@pytest.mark.parametrize("name", bw.HeightMap.procedural_names())
def test_procedural(name: str) -> None:
    hm = bw.HeightMap.procedural(name, (48, 32), seed=5)
    assert hm.shape == (32, 48)
    assert 0 <= hm.array.min() <= hm.array.max() <= 1
    np.testing.assert_array_equal(hm.array, bw.HeightMap.procedural(name, (48, 32), seed=5).array)
    for size in (1, (1, 9), (9, 1), (3, 2)):
        assert np.isfinite(bw.HeightMap.procedural(name, size).array).all()
    if name in SMOOTH:
        fine = bw.HeightMap.procedural(name, 128, seed=5).array
        for axis in (0, 1):
            steps = np.abs(np.roll(fine, -1, axis) - fine)
            border = steps.take(-1, axis).max()
            assert border <= 1.2 * steps.max()


def test_procedural_closed_forms() -> None:
    u = (np.arange(64) + 0.5) / 64
    v = (np.arange(32)[:, None] + 0.5) / 32
    sines = 0.5 + 0.25 * np.sin(6 * np.pi * u) + 0.25 * np.sin(4 * np.pi * v)
    np.testing.assert_allclose(bw.HeightMap.procedural("sines", (64, 32)).array, sines, atol=1e-6)
    dot = bw.HeightMap.procedural("dot", 9).array
    assert dot.sum() == 1
    assert dot[4, 4] == 1


def test_seeds_matter() -> None:
    for name in ("fbm", "bricks", "noise", "terrain"):
        one, two = (bw.HeightMap.procedural(name, 32, seed=seed).array for seed in (0, 1))
        assert not np.array_equal(one, two)


def test_procedural_refuses() -> None:
    make = bw.HeightMap.procedural
    with pytest.raises(ValueError, match="bricks"):
        make("brick")
    for size in (0, -1, 10**9, (5, 0), (65536, 65536), (1, 2, 3)):
        with pytest.raises(ValueError, match="size"):
            make("flat", size)
    for size in (1.5, "8", None, (1.0, 2)):
        with pytest.raises(TypeError, match="whole number"):
            make("flat", size)
    with pytest.raises(ValueError, match="seed"):
        make("flat", 8, seed=-1)
    with pytest.raises(TypeError):
        make(3)


def test_real_maps(assets: Path) -> None:
    terrain = np.load(assets / "matplotlib" / "jacksboro_fault_dem.npz")["elevation"]
    hm = quiet(terrain, height_range="auto")
    assert hm.shape == (344, 403)
    assert hm.bits == 10
    earth = assets / "paramap_earth" / "elevation_surface.jpg"
    with pytest.warns(bw.BumpWarning, match="JPEG"):
        assert bw.HeightMap(earth, invert=True).shape == (2048, 4096)


@pytest.mark.parametrize(
    ("suffix", "error"), [("png", 0.5 / 65535), ("tiff", 0.0), ("TIF", 0.0), ("npy", 0.0)]
)
def test_saved_heights_come_back(suffix: str, error: float, tmp_path: Path) -> None:
    heights = bw.HeightMap.procedural("noise", (13, 9))
    path = heights.save(tmp_path / f"map.{suffix}")
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    back = bw.HeightMap(path)
    assert np.abs(back.array - heights.array).max() <= error + 1e-7 * (error > 0)
    assert back.bits == (16 if suffix == "png" else heights.bits)


def test_heights_that_cannot_be_saved(tmp_path: Path) -> None:
    heights = bw.HeightMap([[0.5]])
    with pytest.raises(ValueError, match="png"):
        heights.save(tmp_path / "map.jpg")
    with pytest.raises(FileNotFoundError):
        heights.save(tmp_path / "absent" / "map.png")
    with pytest.raises(TypeError, match="path"):
        heights.save(3)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
