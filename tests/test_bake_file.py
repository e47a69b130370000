"""bake_file: the same bits as the bake of the whole, in little memory."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import bumpwgpu as bw
from bumpwgpu.baking import KERNELS

WRAPS = ("repeat", "clamp", "mirror")


def rough(size: tuple[int, int], seed: int = 1) -> np.ndarray[Any, np.dtype[np.float32]]:
    return np.random.default_rng(seed).random(size[::-1], dtype=np.float32)


def pixels(path: Path) -> Any:
    values, _, _ = bw._bumpwgpu.read_image(path)
    return values


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("size", [(1, 1), (5, 1), (1, 6), (3, 2), (7, 3), (40, 4), (600, 33)])
def test_the_same_bits(size: tuple[int, int], wrap: Any, tmp_path: Path) -> None:
    heights = rough(size)
    source = tmp_path / "heights.npy"
    np.save(source, heights)
    for kernel in KERNELS:
        hm = bw.HeightMap(heights, wrap=wrap, scale=0.2)
        target = bw.bake_file(source, tmp_path / "normal.npy", wrap=wrap, scale=0.2, kernel=kernel)
        np.testing.assert_array_equal(np.load(target), bw.bake(hm, kernel=kernel)["normal"])
    for bits in (8, 16):
        target = bw.bake_file(source, tmp_path / "n.png", wrap=wrap, scale=0.2, bits=bits)
        np.testing.assert_array_equal(pixels(target), bw.bake(hm, dtype=f"uint{bits}")["normal"])


def test_blocks_join(tmp_path: Path) -> None:
    """Several blocks of rows, each of a million texels."""
    heights = rough((2048, 1300), 3)
    np.save(tmp_path / "h.npy", heights)
    for wrap in WRAPS:
        target = bw.bake_file(tmp_path / "h.npy", tmp_path / "n.png", wrap=wrap, kernel="sobel5")
        expected = bw.bake(bw.HeightMap(heights, wrap=wrap), kernel="sobel5", dtype=np.uint8)["normal"]
        np.testing.assert_array_equal(pixels(target), expected)


@pytest.mark.parametrize("name", ["normal_xy", "relief"])
def test_other_maps(name: str, tmp_path: Path) -> None:
    heights = rough((30, 20))
    np.save(tmp_path / "h.npy", heights)
    target = bw.bake_file(tmp_path / "h.npy", tmp_path / f"{name}.png", name, bits=16, convention="directx")
    bw.bake(bw.HeightMap(heights), name, convention="directx").save(tmp_path / "whole", bits=16)
    whole, _, _ = bw._bumpwgpu.read_image(tmp_path / "whole" / f"{name}.png")
    ours, _, _ = bw._bumpwgpu.read_image(target)
    np.testing.assert_array_equal(ours, whole)
    ours_open, whole_open = bw.Maps.open(tmp_path), bw.Maps.open(tmp_path / "whole")
    np.testing.assert_array_equal(ours_open[name], whole_open[name])
    assert json.loads((tmp_path / f"{name}.json").read_text())["options"]["convention"] == "directx"


def sources(folder: Path) -> dict[str, dict[str, Any]]:
    """Files of all kinds with the same 19 x 13 map, and how to read them."""
    wide = (rough((19, 13), 7) * 65535).astype(np.uint16)
    narrow = (wide >> 8).astype(np.uint8)
    floats = wide.astype(np.float32) / np.float32(65535)
    made: dict[str, dict[str, Any]] = {}
    for name, array in {
        "u1": narrow,
        "u2": wide,
        "big": wide.astype(">u2"),
        "f2": floats.astype(np.float16),
        "f4": floats,
        "f8": floats.astype(">f8"),
        "bool": narrow > 100,
        "third": wide[:, :, None],
    }.items():
        np.save(folder / f"{name}.npy", array)
        made[f"{name}.npy"] = {}
    np.save(folder / "i4.npy", wide.astype(np.int32) - 30000)
    made["i4.npy"] = {"height_range": (-30000, 40000)}
    np.save(folder / "metres.npy", wide.astype(np.float64) * 0.1 - 500)
    made["metres.npy"] = {"height_range": "auto"}
    np.save(folder / "channels.npy", np.stack((narrow, narrow[::-1]), axis=2))
    made["channels.npy"] = {"channel": 1, "invert": True}
    Image.fromarray(narrow).save(folder / "8.png")
    Image.fromarray(wide).save(folder / "16.png")
    Image.fromarray(narrow).convert("1").save(folder / "1.png")
    Image.fromarray(narrow).convert("P").save(folder / "palette.png")
    made |= {"8.png": {}, "16.png": {}, "1.png": {}, "palette.png": {"channel": 0}}
    Image.fromarray(np.dstack((narrow, narrow[::-1], narrow))).save(folder / "rgb.png")
    made["rgb.png"] = {"channel": 1}
    Image.fromarray(floats).save(folder / "f.tif")
    Image.fromarray(wide).save(folder / "16.tif", compression="tiff_lzw")
    Image.fromarray(narrow).save(folder / "8.tif", tiffinfo={278: 4})
    made |= {"f.tif": {}, "16.tif": {}, "8.tif": {}}
    return made


def test_files_of_all_kinds(tmp_path: Path) -> None:
    for name, how in sources(tmp_path).items():
        target = bw.bake_file(tmp_path / name, tmp_path / "out.npy", scale=0.3, **how)
        hm = bw.HeightMap(tmp_path / name, scale=0.3, **how)
        np.testing.assert_array_equal(np.load(target), bw.bake(hm)["normal"], err_msg=name)


def refusals(folder: Path) -> list[tuple[str, dict[str, Any], type[Exception], str]]:
    heights = rough((9, 6))
    np.save(folder / "good.npy", heights)
    np.save(folder / "fortran.npy", np.asfortranarray(heights))
    np.save(folder / "complex.npy", heights.astype(complex))
    np.save(folder / "line.npy", heights[0])
    np.save(folder / "integers.npy", (heights * 100).astype(np.int32))
    np.save(folder / "high.npy", heights * 3)
    holes = heights.copy()
    holes[2, 5] = np.nan
    np.save(folder / "holes.npy", holes)
    whole = (folder / "good.npy").read_bytes()
    (folder / "cut.npy").write_bytes(whole[:-9])
    (folder / "head.npy").write_bytes(whole[:20])
    Image.fromarray((heights * 255).astype(np.uint8)).save(folder / "good.png")
    picture = (folder / "good.png").read_bytes()
    (folder / "cut.png").write_bytes(picture[:-30])
    Image.fromarray((heights * 255).astype(np.uint8)).save(folder / "photo.jpg")
    (folder / "text.png").write_text("no picture")
    return [
        ("nowhere.npy", {}, FileNotFoundError, "nowhere"),
        ("fortran.npy", {}, bw.BakeError, "fortran_order"),
        ("complex.npy", {}, bw.BakeError, "c16"),
        ("line.npy", {}, bw.BakeError, "H, W"),
        ("integers.npy", {}, ValueError, "meaning of their own"),
        ("high.npy", {}, ValueError, r"row \d, column \d"),
        ("holes.npy", {}, ValueError, "row 2, column 5 is NaN"),
        ("holes.npy", {"height_range": "auto"}, ValueError, "row 2, column 5"),
        ("cut.npy", {}, bw.BakeError, "216 bytes"),
        ("head.npy", {}, bw.BakeError, "cut off"),
        ("cut.png", {}, bw.BakeError, r"cut\.png"),
        ("photo.jpg", {}, bw.BakeError, "npy, PNG and TIFF"),
        ("text.png", {}, bw.BakeError, "npy, PNG and TIFF"),
        ("good.npy", {"channel": 3}, ValueError, "channel 3"),
        ("good.npy", {"height_range": (1, 0)}, ValueError, "low < high"),
        ("good.npy", {"map": "pyramid"}, ValueError, "whole height map"),
        ("good.npy", {"map": "cones"}, ValueError, "normal_xy"),
        ("good.npy", {"bits": 12}, ValueError, "8 or 16"),
        ("good.npy", {"wrap": "round"}, ValueError, "mirror"),
        ("good.npy", {"scale": -1}, ValueError, "scale"),
        ("good.npy", {"kernel": "roberts"}, ValueError, "scharr"),
        ("good.npy", {"kernal": "scharr"}, TypeError, "kernel, convention"),
    ]


def test_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    for name, how, error, text in refusals(tmp_path):
        with pytest.raises(error, match=text):
            bw.bake_file(tmp_path / name, out / "n.png", **how)
        assert list(out.iterdir()) == [], name
    with pytest.raises(ValueError, match=r"\.png or \.npy"):
        bw.bake_file(tmp_path / "good.npy", out / "n.gif")
    with pytest.raises((bw.BakeError, OSError), match="missing"):
        bw.bake_file(tmp_path / "good.npy", out / "missing" / "n.png")


def test_an_interlaced_png_says_why(assets: Path, tmp_path: Path) -> None:
    found = sorted(assets.glob("**/basi0g08.png"))
    if not found:
        pytest.skip("no interlaced PNG")
    with pytest.raises(bw.BakeError, match="interlaced"):
        bw.bake_file(found[0], tmp_path / "n.png")


def test_clipped_heights_warn(tmp_path: Path) -> None:
    np.save(tmp_path / "h.npy", np.array([[0.0, 1.005], [0.5, -0.005]], np.float32))
    with pytest.warns(bw.BumpWarning, match="2 heights"):
        bw.bake_file(tmp_path / "h.npy", tmp_path / "n.npy")
    with pytest.warns(bw.BumpWarning, match="clipped"):
        expected = bw.bake(tmp_path / "h.npy")["normal"]
    np.testing.assert_array_equal(np.load(tmp_path / "n.npy"), expected)


def test_progress_and_stopping(tmp_path: Path) -> None:
    np.save(tmp_path / "h.npy", rough((1024, 4096)))
    seen: list[tuple[int, int]] = []
    bw.bake_file(tmp_path / "h.npy", tmp_path / "n.png", progress=lambda *now: seen.append(now))
    assert seen[-1] == (4096, 4096)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    before = (tmp_path / "n.png").read_bytes()

    def stop(done: int, total: int) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        bw.bake_file(tmp_path / "h.npy", tmp_path / "n.png", bits=16, progress=stop)
    assert (tmp_path / "n.png").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["h.npy", "n.json", "n.png"]


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    np.save(tmp_path / "h.npy", rough((4096, 4096)))
    code = "from bumpwgpu.cli import main; main()"
    words = ["bake", "h.npy", "--by-rows", "--bits", "16", "-o", "out"]
    process = subprocess.Popen(
        [sys.executable, "-c", code, *words], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    for _ in range(600):
        if (tmp_path / "out").is_dir() and list((tmp_path / "out").iterdir()):
            break
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert list((tmp_path / "out").iterdir()) == []


# Not what `getrusage` says: that begins with what the process that started this one had.
MEMORY = """
import sys
from pathlib import Path
import numpy
import bumpwgpu as bw
bw.bake_file  # names are loaded when they are first asked for
def peak():
    return int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) * 1024
before = peak()
bw.bake_file(sys.argv[1], sys.argv[2], bits=16, wrap=sys.argv[3])
print(before, peak())
"""


def peak_memory(source: Path, target: Path, wrap: str) -> tuple[int, int]:
    """Bytes at most before and after, in a process of its own."""
    words = [sys.executable, "-c", MEMORY, str(source), str(target), wrap]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=3000)
    before, after = map(int, done.stdout.split())
    return before, after


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory as Linux tells it")
def test_memory_does_not_grow_with_the_map(tmp_path: Path) -> None:
    small, large = tmp_path / "small.npy", tmp_path / "large.npy"
    np.save(small, rough((2048, 1024)))
    np.save(large, rough((2048, 4096)))
    grown = []
    for source in (small, large):
        before, after = peak_memory(source, tmp_path / "n.png", "repeat")
        grown.append(after - before)
    # The larger map has 32 MB of heights and 48 MB of 16-bit normals; measured 24 MB for both.
    assert grown[1] < 40e6, grown
    assert grown[1] - grown[0] < 8e6, grown


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="peak memory as Linux tells it")
@pytest.mark.parametrize("kind", ["npy", "png", "tif"])
def test_16384_in_less_than_a_gigabyte(kind: str, tmp_path: Path) -> None:
    side = 16384
    source = tmp_path / f"h.{kind}"
    tile = (rough((512, 512)) * 65535).astype(np.uint16)
    row = np.tile(tile, (1, side // 512))
    if kind == "npy":
        heights = np.lib.format.open_memmap(source, "w+", np.uint16, (side, side))
        for at in range(0, side, 512):
            heights[at : at + 512] = row
        del heights
    else:
        Image.MAX_IMAGE_PIXELS = None
        options = {"compress_level": 1} if kind == "png" else {"compression": "tiff_deflate"}
        Image.fromarray(np.tile(row, (side // 512, 1))).save(source, **options)
    _, after = peak_memory(source, tmp_path / "n.png", "repeat")
    print(f"{kind}: {after / 2**20:.0f} MiB at most")
    assert after < 1 << 30
    # The map repeats every 512 texels, so its normals do, but for the slope's unit.
    expected = bw.bake(bw.HeightMap(tile, scale=0.1, tile_size=512 / side), dtype=np.uint16)["normal"]
    values = pixels(tmp_path / "n.png")
    for at in (0, 512 * 17, side - 512):
        np.testing.assert_array_equal(values[at : at + 512, side - 512 :], expected)
